// Addresses within the page: "#/monday" is a session, "#/monday/with/tuesday" a comparison.

export interface Route {
  session: string | null;
  other: string | null;
}

export function readRoute(hash: string): Route {
  const [session, word, other] = hash.replace(/^#\/?/, '').split('/');
  if (!isId(session)) return { session: null, other: null };
  return { session, other: word === 'with' && isId(other) && other !== session ? other : null };
}

const isId = (text: string | undefined): text is string => text !== undefined && /^[a-z][a-z0-9-]{0,62}$/.test(text);

export const addressOf = (session: string, other?: string | null): string =>
  other ? `#/${session}/with/${other}` : `#/${session}`;

export const LIST_ADDRESS = '#/';
