// The live page of polyestd: the list of its sessions, or one of them.

import './style/page.css';
import './style/panels.css';
import './style/print.css';

import { setToken, token } from './api/token';
import { type View, h } from './view/dom';
import { preparePrinting } from './view/printing';
import { LIST_ADDRESS, readRoute } from './view/route';
import { SessionPage } from './view/session_page';
import { SessionsPage } from './view/sessions_page';
import { startTheme, themeSwitch } from './view/theme';
import { tokenForm } from './view/token_form';

const content = h('main', { id: 'content', tabindex: '-1' });
const forget = h('button.quiet', { type: 'button' }, 'Forget token');
let view: View | null = null;

function show(element: HTMLElement, next: View | null): void {
  view?.dispose();
  view = next;
  content.replaceChildren(element);
  forget.hidden = token() === '';
}

function askForToken(reason: string): void {
  delete document.body.dataset['status'];
  const form = tokenForm(reason, open);
  show(form, null);
  form.querySelector('input')?.focus();
}

function open(): void {
  const { session, other } = readRoute(location.hash);
  delete document.body.dataset['status'];
  document.title = session ? `${session} · polyest` : 'polyest';
  const next = session ? new SessionPage(session, other, askForToken) : new SessionsPage(askForToken);
  show(next.element, next);
}

function start(): void {
  startTheme();
  preparePrinting();
  forget.addEventListener('click', () => {
    setToken('');
    open();
  });
  const skip = h('a.skip', { href: '#content' }, 'Skip to the content');
  skip.addEventListener('click', (event) => {
    event.preventDefault();  // the address says which session is shown
    content.focus();
  });
  const top = h('div.top', {},
    h('a.brand', { href: LIST_ADDRESS }, 'polyest'),
    h('div.top-right', {}, forget, themeSwitch()));
  document.getElementById('app')?.append(skip, h('header', {}, top), content);
  addEventListener('hashchange', () => {
    open();
    content.focus();
    scrollTo(0, 0);
  });
  open();
}

start();
