// Words that explain themselves: on hovering, focus, or touch. Escape hides the explanation.

import { h } from './dom';

const ids = new Map<string, string>();
let hidden: HTMLElement | null = null;
let bubble: HTMLElement | null = null;

// Returns the id of an element with the text, for aria-describedby.
function idOf(text: string): string {
  let id = ids.get(text);
  if (id === undefined) {
    hidden ??= document.body.appendChild(h('div', { hidden: true }));
    id = `explanation-${ids.size}`;
    ids.set(text, id);
    hidden.append(h('span', { id }, text));
  }
  return id;
}

function show(anchor: HTMLElement, text: string): void {
  bubble ??= document.body.appendChild(h('div.bubble', { 'aria-hidden': 'true' }));
  bubble.textContent = text;
  bubble.hidden = false;
  const at = anchor.getBoundingClientRect();
  const size = bubble.getBoundingClientRect();
  const left = Math.max(8, Math.min(at.left, innerWidth - size.width - 8));
  const below = at.bottom + 6;
  const top = below + size.height < innerHeight ? below : Math.max(8, at.top - size.height - 6);
  bubble.style.left = `${left}px`;
  bubble.style.top = `${top}px`;
}

export function hideTooltip(): void {
  if (bubble) bubble.hidden = true;
}

document.addEventListener('keydown', (event) => {
  if (event.key === 'Escape') hideTooltip();
});
document.addEventListener('scroll', hideTooltip, { passive: true, capture: true });

// A word that explains itself.
export function term(label: string, text: string): HTMLButtonElement {
  return explained(h('button.term', { type: 'button' }, label), text);
}

// Makes a button explain itself, and returns it.
export function explained(button: HTMLButtonElement, text: string): HTMLButtonElement {
  button.setAttribute('aria-describedby', idOf(text));
  const open = (): void => show(button, explanationOf(button) ?? text);
  button.addEventListener('mouseenter', open);
  button.addEventListener('focus', open);
  button.addEventListener('click', open);
  button.addEventListener('mouseleave', hideTooltip);
  button.addEventListener('blur', hideTooltip);
  return button;
}

const explanationOf = (button: HTMLElement): string | undefined => button.dataset['explanation'];

// Gives a word another explanation. `text` must be one of a bounded number of texts.
export function explainTerm(button: HTMLElement, text: string): void {
  if (explanationOf(button) === text) return;
  button.dataset['explanation'] = text;
  button.setAttribute('aria-describedby', idOf(text));
}
