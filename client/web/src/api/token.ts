// Keeps the access token for as long as this tab lives.

const KEY = 'polyest.token';

// Storage may be switched off in the browser; the token then lives as long as the page.
let kept = '';

export function token(): string {
  try {
    return sessionStorage.getItem(KEY) ?? kept;
  } catch {
    return kept;
  }
}

export function setToken(value: string): void {
  kept = value;
  try {
    if (value === '') sessionStorage.removeItem(KEY);
    else sessionStorage.setItem(KEY, value);
  } catch {
    // kept above
  }
}

// A header's value may hold visible ASCII only; fetch() would throw on others.
export const isPossibleToken = (value: string): boolean => /^[\x21-\x7e]+$/.test(value);
