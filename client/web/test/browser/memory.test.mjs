// A tab that is left open: a hundred thousand estimates must not make it grow.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { FakeDaemon } from '../fake/fake_daemon.mjs';
import { launch, missing, open, quiet, status, until } from './harness.mjs';

const EVENTS = 100_000;
const daemon = new FakeDaemon();
let browser;
before(async () => {
  if (missing) return;
  await daemon.start();
  browser = await launch();
});
after(async () => {
  if (missing) return;
  await browser.close();
  await daemon.stop();
});

test('a hundred thousand estimates leave the heap as it was', { skip: missing || false, timeout: 120_000 }, async () => {
  const session = daemon.add('monday', { count: 1, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  await until(() => session.watchers.size === 1, 'a watcher');
  // Alarms come and go; the answer is only written when the page has taken what came before.
  const feed = async (count) => {
    const [watcher] = session.watchers;
    for (let k = 0; k < count; k += 100) {
      session.diagnostics = k % 400 < 200 ? [{ code: 'MODEL_MISFIT', message: `the residuals are ${k} times the noise` }] : [];
      session.push(100);
      if (watcher.writableNeedDrain) await new Promise((resolve) => { watcher.once('drain', resolve); });
    }
    const samples = session.estimate().samples;
    await page.waitForFunction((text) => document.querySelector('.progress').textContent.replace(/\s/g, '').includes(`·${text}samples`), samples, { timeout: 60_000 });
  };
  const client = await page.context().newCDPSession(page);
  const heap = async () => {
    await client.send('HeapProfiler.collectGarbage');
    return (await client.send('Runtime.getHeapUsage')).usedSize / 2 ** 20;
  };
  const elements = () => page.evaluate(() => document.querySelectorAll('*').length);
  await feed(EVENTS / 10);
  const [before, elementsBefore] = [await heap(), await elements()];
  await feed(EVENTS * 0.9);
  const [grown, elementsAfter] = [await heap(), await elements()];
  // An estimate is 2 kB of JSON: keeping one in a hundred would be 2 MiB.
  assert.ok(grown - before < 2, `the heap went from ${before.toFixed(1)} to ${grown.toFixed(1)} MiB`);
  assert.ok(elementsAfter <= elementsBefore + 100, `${elementsBefore} elements became ${elementsAfter}`);
  await status(page, 'Live').catch(() => undefined);
  quiet(page);
  await page.context().close();
});
