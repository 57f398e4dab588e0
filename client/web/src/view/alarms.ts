// The estimate's diagnostics as alarms: what, since when, what it means, what to do.

import type { Alarm, AlarmLog, Moment } from '../state/alarms';
import { explain } from '../text/diagnostics';
import { recordTime } from '../text/number';
import { type View, h } from './dom';

function moment({ time, at }: Moment): string {
  const clock = at ? ` (${at.toLocaleTimeString(undefined, { hour12: false })})` : '';
  return `t = ${recordTime(time)}${clock}`;
}

function since({ began, beganBefore, ended }: Alarm): string {
  const start = beganBefore ? `the first estimate known, ${moment(began)}` : moment(began);
  return ended ? `From ${start} until ${moment(ended)}` : `Since ${start}`;
}

function item(alarm: Alarm): HTMLElement {
  const { title, meaning, remedy, severity } = explain(alarm.code);
  const details = h('details', { 'data-code': alarm.code },
    h('summary', {}, h('strong', {}, title), h('span.since', {}, since(alarm))),
    ...(alarm.messages.length > 0 ? [h('ul.messages', {}, ...alarm.messages.map((message) => h('li', {}, message)))] : []),
    h('p', {}, h('b', {}, 'What it means. '), meaning),
    h('p', {}, h('b', {}, 'What to do. '), remedy),
    h('p.code', {}, alarm.code));
  return h(`li.alarm.${severity}`, {}, details);
}

export class AlarmsView implements View {
  readonly element: HTMLElement;
  private readonly list = h('ul.alarms');
  private readonly calm = h('p.calm', {}, 'No warnings: the estimate is as good as polyest can tell.');
  private readonly past = h('details.past', {}, h('summary', {}, 'Earlier warnings'));
  private readonly pastList = h('ul.alarms');
  private key = '';

  constructor() {
    this.past.append(this.pastList);
    this.element = h('section.alarm-board', { 'aria-label': 'Warnings' }, this.calm, this.list, this.past);
  }

  update(log: AlarmLog): void {
    const key = JSON.stringify([log.active, log.ended]);
    if (key === this.key) return;
    this.key = key;
    this.calm.hidden = log.active.length > 0;
    this.fill(this.list, log.active);
    this.fill(this.pastList, log.ended);
    this.past.hidden = log.ended.length === 0;
  }

  dispose(): void {
    this.element.remove();
  }

  // Those that are open stay open, and the focus stays where it is.
  private fill(list: HTMLElement, alarms: readonly Alarm[]): void {
    const codeOf = (element: Element | null | undefined): string => element?.closest('details')?.dataset['code'] ?? '';
    const open = new Set([...list.querySelectorAll('details[open]')].map(codeOf));
    const focused = list.contains(document.activeElement) ? codeOf(document.activeElement) : '';
    list.replaceChildren(...alarms.map(item));
    for (const details of list.querySelectorAll('details')) {
      if (open.has(codeOf(details))) details.open = true;
      if (focused !== '' && codeOf(details) === focused) details.querySelector('summary')?.focus();
    }
  }
}
