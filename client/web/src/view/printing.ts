// Printing: the page in light colours and at the width of A4, every chart drawn, every warning open,
// without what can be pressed. The style sheet print.css has the rest.

import { showInLight } from './theme';

// Is dispatched before the page is printed, to fill in what only paper shows.
export const PRINT_EVENT = 'polyest-print';

let opened: HTMLDetailsElement[] = [];
let scrolled = 0;
let isPrinting = false;
let hasBegun = false;  // whether the browser has said that it prints

function begin(): void {
  if (isPrinting) return;
  isPrinting = true;
  scrolled = scrollY;
  document.dispatchEvent(new Event(PRINT_EVENT));
  opened = [...document.querySelectorAll<HTMLDetailsElement>('.alarm-board details:not([open])')];
  for (const details of opened) details.open = true;
  document.documentElement.dataset['printing'] = '';
  showInLight(true);  // draws the charts anew, at their new width
}

function end(): void {
  if (!isPrinting) return;
  isPrinting = false;
  for (const details of opened) details.open = false;
  opened = [];
  delete document.documentElement.dataset['printing'];
  showInLight(false);
  scrollTo(0, scrolled);
}

// Prepares the page whenever the browser prints, by the button or by its own menu.
export function preparePrinting(): void {
  addEventListener('beforeprint', () => {
    hasBegun = true;
    begin();
  });
  addEventListener('afterprint', end);
}

// Prints the page.
export async function printPage(): Promise<void> {
  begin();
  await new Promise((resolve) => { requestAnimationFrame(resolve); });  // charts draw after the script
  hasBegun = false;
  window.print();
  if (!hasBegun) end();  // the browser cannot print
}
