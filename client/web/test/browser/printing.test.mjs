// The page on paper: by its button and by the browser's own menu, in light colours, without controls.

import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { FakeDaemon } from '../fake/fake_daemon.mjs';
import { findings, hasNoNonsense, inked, launch, missing, open, picture, quiet, says } from './harness.mjs';

const daemon = new FakeDaemon();
const options = { skip: missing || false };
let browser;

before(async () => {
  if (missing) return;
  const session = daemon.add('monday', { count: 400 });
  session.diagnostics = [{ code: 'MODEL_MISFIT', message: 'the residuals of x are 1.4 times the noise' }];
  daemon.add('empty', { count: 0 });
  await daemon.start();
  browser = await launch();
});

after(async () => {
  if (missing) return;
  await browser.close();
  await daemon.stop();
});

// Opens the session in dark colours and waits until every panel has its picture.
async function openMonday(changes = {}) {
  const page = await open(browser, `${daemon.address}#/monday`, { colorScheme: 'dark', ...changes });
  await says(page, 'Measured and predicted: x');
  await page.waitForSelector('.corner[aria-label^="Posterior of k, c"]');
  await says(page, 'polyestd 0.1.0');
  return page;
}

const visible = (page, selector) => page.locator(selector).filter({ visible: true }).count();
const ground = (page) => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
const openDetails = (page) => page.locator('.alarm-board details[open]').count();

// Replaces the browser's dialog: says what a browser says, with a look at the page in between.
const withoutDialog = (page) => page.evaluate(() => {
  globalThis.printed = 0;
  window.print = () => {
    dispatchEvent(new Event('beforeprint'));
    globalThis.printed += document.documentElement.hasAttribute('data-printing') ? 1 : 0;
    dispatchEvent(new Event('afterprint'));
  };
});

for (const width of [1280, 390]) {
  test(`paper has all panels in light colours and nothing to press, from ${width} pixels`, options, async () => {
    const page = await openMonday({ width });
    const dark = await ground(page);
    await page.emulateMedia({ media: 'print' });
    await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
    assert.equal(await ground(page), 'rgb(255, 255, 255)');
    for (const text of ['polyest: report of a session', 'MODEL_MISFIT', '1.4 times the noise', 'Determined by the data',
                        'Measured and predicted: x', 'What is probable together', 'The data determine every combination', '35 × real time']) {
      await says(page, text);
    }
    assert.match(await page.locator('pre.problem').innerText(), /"uncertain": \[\s+\{"name": "k", "uniform": \{"lower": 31.584, "upper": 47.376\}\}/);
    const facts = await page.locator('section.paper .facts').innerText();
    assert.match(facts, /Printed\s+\d{4}-\d\d-\d\d \d\d:\d\d UTC[+−]\d\d:\d\d/);
    assert.match(facts, /Daemon\s+polyestd 0\.1\.0/);
    assert.match(facts, /Address\s+127\.0\.0\.1:\d+\/#\/monday/);
    assert.equal(await visible(page, 'button:not(.term), input, summary:text("Download"), .back'), 0);
    for (const canvas of ['.strip canvas', '.signals .chart canvas', '.split .chart canvas', '.corner canvas']) {
      assert.ok(await inked(page, canvas) > 2000, `${canvas} is drawn, though it was never seen`);
    }
    // Charts have the width of their places, and nothing reaches beyond the paper.
    const wrong = await page.evaluate(() => [...document.querySelectorAll('.chart')].filter((chart) => {
      const [plot, place] = [chart.querySelector('.uplot'), chart.querySelector('.plot')];
      return plot && Math.abs(plot.clientWidth - place.clientWidth) > 1;
    }).length);
    assert.equal(wrong, 0);
    assert.ok(await page.evaluate(() => [...document.querySelectorAll('#app *')].every((each) => each.getBoundingClientRect().right <= 713)));
    await hasNoNonsense(page);
    assert.deepEqual(await findings(page), []);
    await picture(page, `printed-${width}`);
    await page.evaluate(() => dispatchEvent(new Event('afterprint')));
    await page.emulateMedia({ media: null });
    assert.equal(await ground(page), dark);
    assert.equal(await openDetails(page), 0);
    assert.equal(await visible(page, '.paper'), 0);
    assert.deepEqual(await findings(page), []);
    quiet(page);
    await page.context().close();
  });
}

test('a browser that prints by itself gets a few pages of A4', options, async () => {
  const page = await openMonday();
  const pdf = await page.pdf({ preferCSSPageSize: true });
  const text = pdf.toString('latin1');
  const pages = text.match(/\/Type \/Page\b/g).length;
  assert.ok(pages >= 2 && pages <= 4, `${pages} pages`);
  const [, wide, high] = /\/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]/.exec(text).map(Number);
  assert.ok(Math.abs(wide - 595) < 2 && Math.abs(high - 842) < 2, `${wide} × ${high} points`);
  if (process.env.POLYEST_PICTURES) {
    mkdirSync(process.env.POLYEST_PICTURES, { recursive: true });
    writeFileSync(join(process.env.POLYEST_PICTURES, 'printed.pdf'), pdf);
  }
  assert.equal(await visible(page, '.paper'), 0);
  quiet(page);
  await page.context().close();
});

test('the button prints, and the page is then as it was', options, async () => {
  const page = await openMonday();
  await page.locator('.alarm-board summary').first().click();
  const dark = await ground(page);
  await withoutDialog(page);
  const button = page.getByRole('button', { name: 'Print report' });
  await button.hover();
  await says(page, 'Prints what the page shows now on A4');
  await button.click();
  await page.waitForFunction(() => globalThis.printed === 1);
  assert.equal(await ground(page), dark);
  assert.equal(await visible(page, '.paper'), 0);
  assert.equal(await openDetails(page), 1, 'the warning that was open');
  // The charts have the width of the screen again.
  await page.waitForFunction(() => document.querySelector('.strip .uplot').clientWidth === document.querySelector('.strip .plot').clientWidth);
  quiet(page);
  await page.context().close();
});

test('a browser that cannot print leaves the page as it is', options, async () => {
  const page = await openMonday();
  const dark = await ground(page);
  await page.evaluate(() => { window.print = () => { globalThis.printed = 1; }; });
  await page.getByRole('button', { name: 'Print report' }).click();
  await page.waitForFunction(() => globalThis.printed === 1);
  assert.equal(await ground(page), dark);
  assert.equal(await page.evaluate(() => document.documentElement.hasAttribute('data-printing')), false);
  quiet(page);
  await page.context().close();
});

test('without an estimate there is nothing to print', options, async () => {
  const page = await open(browser, `${daemon.address}#/empty`);
  await page.getByRole('button', { name: 'Print report' }).click();
  await says(page, 'There is no estimate to print yet.');
  quiet(page);
  await page.context().close();
});
