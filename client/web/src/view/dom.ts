// Makes and changes elements. Text is always set as text: nothing that comes from the daemon is
// ever read as markup.

type Child = Node | string | null | false;
type Attributes = { [name: string]: string | boolean | EventListener };

// Makes an element: h('button.primary', {type: 'button', onclick: f}, 'Text').
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K | `${K}.${string}`, attributes: Attributes = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const [name, ...classes] = tag.split('.') as [K, ...string[]];
  const element = document.createElement(name);
  if (classes.length > 0) element.className = classes.join(' ');
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(key.replace(/^on/, ''), value);
    else if (typeof value === 'boolean') element.toggleAttribute(key, value);
    else element.setAttribute(key, value);
  }
  for (const child of children) {
    if (child !== null && child !== false) element.append(child);
  }
  return element;
}

// Sets a text if it is another one, so that nothing is laid out or read aloud in vain.
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function setAttribute(element: Element, name: string, value: string): void {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

export function setShown(element: HTMLElement, isShown: boolean): void {
  if (element.hidden === isShown) element.hidden = !isShown;
}

// A panel of the page: a titled card.
export function card(title: Child, ...children: Child[]): HTMLElement {
  return h('section.card', {}, h('h2', {}, title), ...children);
}

// A part of the page that shows something and can be taken away.
export interface View {
  readonly element: HTMLElement;
  dispose(): void;
}

// Says something to screen readers, once.
let announcer: HTMLElement | null = null;
export function announce(text: string): void {
  if (!announcer) {
    announcer = h('div.unseen', { role: 'status', 'aria-live': 'polite' });
    document.body.append(announcer);
  }
  announcer.textContent = text;
}
