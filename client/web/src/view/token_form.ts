// Asks for the access token.

import { isPossibleToken, setToken, token } from '../api/token';
import { h, setText } from './dom';

// `reason`: what the daemon answered. `onToken` is called when there is a new token.
export function tokenForm(reason: string, onToken: () => void): HTMLElement {
  const field = h('input', {
    type: 'password', id: 'token', name: 'token', autocomplete: 'off', spellcheck: 'false', required: true,
    'aria-describedby': 'token-help token-error',
  });
  const error = h('p.trouble', { id: 'token-error', role: 'alert', hidden: true });
  const onSubmit = (event: Event): void => {
    event.preventDefault();
    const value = field.value.trim();
    if (isPossibleToken(value)) {
      setToken(value);
      onToken();
      return;
    }
    setText(error, 'A token has letters, digits and signs only, without spaces.');
    error.hidden = false;
    field.focus();
  };
  const wasRefused = token() !== '';
  return h('section.card.centre', {},
    h('h1', {}, wasRefused ? 'This token is not accepted' : 'This daemon asks for a token'),
    h('p', { id: 'token-help' },
      wasRefused ? 'It may have been removed, or mistyped. ' : '',
      'Whoever runs the daemon gives you one; a reader’s is enough for this page. It stays in this tab only.'),
    h('form', { onsubmit: onSubmit },
      h('label', { for: 'token' }, 'Access token'),
      h('div.row', {}, field, h('button.primary', { type: 'submit' }, 'Continue')),
      error),
    h('p.note', {}, `The daemon said: ${reason}`));
}
