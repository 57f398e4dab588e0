// What can be done with a session that is watched: nothing of it changes the session, so that a
// reader's token is enough for all of it.

import * as client from '../api/client';
import { CallError } from '../api/errors';
import { addressOf } from './route';
import { download, type Kind } from './download';
import { TERMS } from '../text/terms';
import { h, setText } from './dom';
import { printPage } from './printing';
import { explained } from './tooltip';
import type { Estimate } from '../api/messages';

export interface ToolbarEvents {
  onFreeze: (isFrozen: boolean) => void;
  onWhole: (isWhole: boolean) => void;
  estimate: () => Estimate | null;
}

function toggle(label: string, onToggle: (pressed: boolean) => void): HTMLButtonElement {
  const button = h('button', { type: 'button', 'aria-pressed': 'false' }, label);
  button.addEventListener('click', () => {
    const pressed = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', String(pressed));
    onToggle(pressed);
  });
  return button;
}

const DOWNLOADS: { kind: Kind; label: string }[] = [
  { kind: 'json', label: 'Everything (JSON)' },
  { kind: 'estimates', label: 'Estimates (CSV)' },
  { kind: 'history', label: 'History (CSV)' },
];

function downloads(id: string, events: ToolbarEvents, say: (text: string) => void): HTMLElement {
  const menu = h('details.menu', {}, h('summary', {}, 'Download'));
  const items = h('div.menu-items');
  for (const { kind, label } of DOWNLOADS) {
    const start = async (): Promise<void> => {
      menu.open = false;
      try {
        await download(kind, id, events.estimate());
        say('');
      } catch (thrown) {
        say(`Not downloaded: ${thrown instanceof CallError ? thrown.message : String(thrown)}.`);
      }
    };
    items.append(h('button', { type: 'button', 'data-kind': kind, onclick: () => void start() }, label));
  }
  menu.append(items);
  menu.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape' || !menu.open) return;
    menu.open = false;
    menu.querySelector('summary')?.focus();
  });
  menu.addEventListener('focusout', (event) => {
    if (event.relatedTarget instanceof Node && !menu.contains(event.relatedTarget)) menu.open = false;
  });
  return menu;
}

// Sessions to compare with are read when the field is used.
function comparison(id: string, say: (text: string) => void): HTMLElement {
  const list = h('datalist', { id: 'other-sessions' });
  const field = h('input', { type: 'text', id: 'other', list: 'other-sessions', autocomplete: 'off', spellcheck: 'false', placeholder: 'session' });
  let known = new Set<string>();
  field.addEventListener('focus', () => {
    void client.listSessions(200, '').then(({ sessions }) => {
      const others = sessions.filter((session) => session.id !== id);
      known = new Set(others.map((session) => session.id));
      list.replaceChildren(...others.map((session) => h('option', { value: session.id })));
    }).catch(() => undefined);
  });
  const go = (mustBeKnown: boolean): void => {
    const other = field.value.trim().replace(/^sessions\//, '');
    if (other === '' || (mustBeKnown && !known.has(other))) return;
    if (other === id) {
      say('That is this session.');
      return;
    }
    if (!/^[a-z][a-z0-9-]{0,62}$/.test(other)) {
      say(`No session can be named ${other}.`);
      return;
    }
    location.hash = addressOf(id, other);
  };
  field.addEventListener('input', () => go(true));
  const form = h('form.compare', { onsubmit: (event) => {
    event.preventDefault();
    go(false);
  } }, h('label', { for: 'other' }, 'Compare with'), field, list);
  return form;
}

function printing(events: ToolbarEvents, say: (text: string) => void): HTMLButtonElement {
  const print = (): void => {
    if (events.estimate()) void printPage();
    else say('There is no estimate to print yet.');
  };
  return explained(h('button', { type: 'button', onclick: print }, 'Print report'), TERMS.print);
}

export function toolbar(id: string, events: ToolbarEvents): HTMLElement {
  const trouble = h('p.trouble', { role: 'alert', hidden: true });
  const say = (text: string): void => {
    setText(trouble, text);
    trouble.hidden = text === '';
  };
  return h('div.tools', {},
    h('div.tool-row', {},
      toggle('Freeze', events.onFreeze),
      toggle('Whole prior', events.onWhole),
      comparison(id, say),
      downloads(id, events, say),
      printing(events, say)),
    trouble);
}
