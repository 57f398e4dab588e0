// Light or dark: as the system has it, or as chosen by the switch.

import { h } from './dom';

type Choice = 'auto' | 'light' | 'dark';
const KEY = 'polyest.theme';
const NEXT: Record<Choice, Choice> = { auto: 'light', light: 'dark', dark: 'auto' };
const LABEL: Record<Choice, string> = { auto: 'Auto', light: 'Light', dark: 'Dark' };

export const THEME_EVENT = 'polyest-theme';

function stored(): Choice {
  try {
    const value = localStorage.getItem(KEY);
    return value === 'light' || value === 'dark' ? value : 'auto';
  } catch {
    return 'auto';
  }
}

let isInLight = false;  // whatever is chosen: for paper

function apply(chosen: Choice): void {
  const choice = isInLight ? 'light' : chosen;
  if (choice === 'auto') delete document.documentElement.dataset['theme'];
  else document.documentElement.dataset['theme'] = choice;
  document.dispatchEvent(new Event(THEME_EVENT));
}

export function startTheme(): void {
  apply(stored());
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => apply(stored()));
}

// Shows the page in light colours, or again in those that are chosen. Charts are drawn anew.
export function showInLight(isLight: boolean): void {
  isInLight = isLight;
  apply(stored());
}

export function themeSwitch(): HTMLButtonElement {
  let choice = stored();
  const text = (): string => `Colours: ${LABEL[choice]}`;
  const button = h('button.quiet', { type: 'button' }, text());
  button.addEventListener('click', () => {
    choice = NEXT[choice];
    try {
      localStorage.setItem(KEY, choice);
    } catch {
      // The choice then lasts as long as the page.
    }
    button.textContent = text();
    apply(choice);
  });
  return button;
}

// The present value of a colour of the style sheet, such as "--accent".
export const colour = (name: string): string =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();
