// A row of buttons of which one is pressed.

import { h } from './dom';

export interface Choice {
  element: HTMLElement;
  set(options: readonly { value: string; label: string }[], chosen: string): void;
}

export function choice(label: string, onChoose: (value: string) => void): Choice {
  const element = h('div.choice', { role: 'group', 'aria-label': label });
  let values = '';
  const press = (chosen: string): void => {
    for (const button of element.children) {
      button.setAttribute('aria-pressed', String((button as HTMLElement).dataset['value'] === chosen));
    }
  };
  return {
    element,
    set(options, chosen) {
      const key = JSON.stringify(options);
      if (key !== values) {
        values = key;
        const focused = (document.activeElement as HTMLElement | null)?.dataset['value'];
        const hadFocus = element.contains(document.activeElement);
        element.replaceChildren(...options.map(({ value, label: text }) => {
          const button = h('button', { type: 'button', 'data-value': value }, text);
          button.addEventListener('click', () => {
            press(value);
            onChoose(value);
          });
          return button;
        }));
        if (hadFocus) element.querySelector<HTMLElement>(`[data-value="${CSS.escape(focused ?? '')}"]`)?.focus();
      }
      const known = options.some(({ value }) => value === chosen);
      press(known ? chosen : options[0]?.value ?? '');
      element.hidden = options.length < 2;
    },
  };
}
