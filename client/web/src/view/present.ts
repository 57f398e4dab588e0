// Where things are at the last sample: the model's states and the parameters that drift, as the
// filters have them. Models without process noise and drift have none.

import type { Estimate } from '../api/messages';
import { measured, withUnit } from '../text/number';
import { type View, card, setShown } from './dom';
import { facts } from './facts';

export class PresentView implements View {
  readonly element: HTMLElement;
  private readonly facts = facts();

  constructor() {
    this.element = card('At the last sample', this.facts.element);
    this.element.hidden = true;
    this.facts.element.classList.add('wide');
  }

  update({ filtered }: Estimate): void {
    setShown(this.element, filtered.length > 0);
    this.facts.set(filtered.map(({ name, unit, mean, stdDev }) => {
      const { value, deviation, power } = measured(mean, stdDev);
      return { label: name, explanation: '', text: withUnit(`${value} ± ${deviation}${power}`, unit) };
    }));
  }

  dispose(): void {
    this.element.remove();
  }
}
