// A few numbers, each with a name that explains itself.

import { h, setText } from './dom';
import { term } from './tooltip';

export interface Fact {
  label: string;
  explanation: string;
  text: string;
  tone?: 'good' | 'weak' | 'bad';
}

export interface Facts {
  element: HTMLElement;
  set(facts: readonly Fact[]): void;
}

export function facts(): Facts {
  const element = h('dl.facts');
  let labels = '';
  let values: HTMLElement[] = [];
  return {
    element,
    set(entries) {
      const key = entries.map(({ label }) => label).join('\n');
      if (key !== labels) {
        labels = key;
        values = entries.map(() => h('dd'));
        element.replaceChildren(...entries.map(({ label, explanation }, i) =>
          h('div', {}, h('dt', {}, explanation === '' ? label : term(label, explanation)), values[i] as HTMLElement)));
      }
      entries.forEach(({ text, tone }, i) => {
        const value = values[i] as HTMLElement;
        setText(value, text);
        if ((value.dataset['tone'] ?? '') !== (tone ?? '')) value.dataset['tone'] = tone ?? '';
      });
    },
  };
}
