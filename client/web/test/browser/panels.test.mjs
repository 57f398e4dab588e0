// Every panel of a session that is streamed, on wide and narrow screens, light and dark.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';

import { FakeDaemon, Failure } from '../fake/fake_daemon.mjs';
import { findings, hasNoNonsense, inked, launch, missing, open, picture, quiet, says, seeAll, status, until } from './harness.mjs';

const daemon = new FakeDaemon();
const misfit = { code: 'MODEL_MISFIT', message: 'the residuals of x are 1.4 times the noise' };
let browser;
let live;
let timer;

before(async () => {
  if (missing) return;
  live = daemon.add('monday', { count: 60, hasWriter: true });
  daemon.add('tuesday', { count: 200 });
  await daemon.start();
  timer = setInterval(() => live.push(), 100);
  browser = await launch();
});

after(async () => {
  if (missing) return;
  clearInterval(timer);
  await browser.close();
  await daemon.stop();
});

const options = { skip: missing || false };
const text = (page, selector) => page.locator(selector).first().innerText();

test('each panel shows its part of the stream', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Live');
  await page.waitForSelector('.strip[data-verdict=IDENTIFIED] .value');
  await until(async () => (await page.locator('.strip').count()) === 2, 'two strips');
  assert.match(await text(page, '.strip .value'), /^41\.\d+$/);
  assert.match(await text(page, '.strip .unit'), /^N\/m$/);
  assert.match(await text(page, '.strip .deviation'), /^± 0\.0\d+$/);
  assert.match(await text(page, '.strip .verdict'), /Determined by the data/);
  assert.match(await text(page, '.strip .detail'), /Before: 32\.0 … 47\.0 N\/m · now \d+ × narrower/);
  await says(page, 'Measured and predicted: x');
  await says(page, 'The data determine every combination');
  await says(page, '35 × real time');
  await says(page, 'polyestd 0.1.0');
  await says(page, /^94\.1 %$/);
  await page.waitForSelector('.corner[aria-label^="Posterior of k, c"]');
  await seeAll(page);
  for (const canvas of ['.strip canvas', '.signals .chart canvas', '.split .chart canvas', '.corner canvas']) {
    assert.ok(await inked(page, canvas) > 2000, `${canvas} is drawn`);
  }
  await hasNoNonsense(page);
  quiet(page);
  await page.context().close();
});

test('the history of a session is there when a page is opened late', options, async () => {
  const page = await open(browser, `${daemon.address}#/tuesday`);
  await status(page, 'Idle');
  await page.waitForSelector('.strip canvas');
  await page.locator('.strip .u-over').first().hover({ position: { x: 40, y: 40 } });
  // The beginning of a record that was over long ago.
  await until(async () => /^[1-5]\.\d\d s:/.test(await text(page, '.strip .readout')), 'a reading near the beginning');
  await page.context().close();
});

test('the whole course of a long session stays while the page watches', options, async () => {
  const long = daemon.add('wednesday', { count: 40_000, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/wednesday`);
  await status(page, 'Live');
  await page.waitForSelector('.strip canvas');
  const end = long.history().history.points.at(-1).timeS;
  // Readings of the chart at some shares of its width, s.
  const readings = async () => {
    const over = page.locator('.strip .u-over').first();
    const { width } = await over.boundingBox();
    const found = [];
    for (const share of [0.01, 0.25, 0.5, 0.75, 0.99]) {
      await over.hover({ position: { x: share * width, y: 40 } });
      await until(async () => (await text(page, '.strip .readout')) !== '', 'a reading');
      found.push(Number((await text(page, '.strip .readout')).split(' s:')[0].replace(/\s/g, '')) / (share * end));
    }
    return found;
  };
  const near = (value) => value > 0.9 && value < 1.1;
  assert.ok((await readings()).slice(1).every(near), String(await readings()));
  for (let k = 0; k < 40; ++k) {
    long.push(100);
    await page.waitForTimeout(20);
  }
  const samples = long.estimate().samples;
  await page.waitForFunction((wanted) => document.querySelector('.progress').textContent.replace(/\s/g, '').includes(`·${wanted}samples`), samples);
  const then = (await readings()).map((value) => value * end / long.estimate().time);
  assert.ok(then.slice(1).every(near), String(then));
  daemon.delete('wednesday');
  quiet(page);
  await page.context().close();
});

test('numbers follow the stream until they are frozen, and then again', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Live');
  const progress = () => text(page, '.progress');
  const first = await progress();
  await until(async () => (await progress()) !== first, 'the record goes on');
  await page.getByRole('button', { name: 'Freeze' }).click();
  await says(page, /Frozen: \d+ new estimates/);
  const frozen = await progress();
  await page.waitForTimeout(600);
  assert.equal(await progress(), frozen);
  await page.getByRole('button', { name: 'Freeze', pressed: true }).click();
  await until(async () => (await progress()) !== frozen, 'the record goes on again');
  quiet(page);
  await page.context().close();
});

test('diagnostics are alarms that say since when, and what to do', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Live');
  await says(page, 'No warnings');
  live.diagnostics = [misfit];
  const alarm = page.locator('.alarm-board .alarm').first();
  await alarm.waitFor();
  assert.match(await alarm.innerText(), /Model does not fit the measurements\s+Since t = [\d. ]+ s/);
  await alarm.locator('summary').click();
  await says(page, '1.4 times the noise');
  await says(page, 'What to do');
  assert.deepEqual(await findings(page), []);
  await picture(page, 'alarm');
  live.diagnostics = [];
  await says(page, 'No warnings');
  await says(page, 'Earlier warnings');
  // A page that is opened later knows from the history when it began, and what is over.
  live.diagnostics = [misfit];
  await alarm.waitFor();
  const began = (await alarm.innerText()).match(/Since (t = [\d. ]+ s)/)[1];
  await page.reload();
  await says(page, `Since ${began}`);
  assert.doesNotMatch(await alarm.innerText(), /\d\d:\d\d/);
  await says(page, 'Earlier warnings');
  live.diagnostics = [];
  quiet(page);
  await page.context().close();
});

test('two sessions are compared in words', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Live');
  await page.getByLabel('Compare with').fill('tuesday');
  await page.getByLabel('Compare with').press('Enter');
  await says(page, 'monday compared with tuesday');
  await says(page, /They agree|standard deviations apart/);
  assert.equal(await page.locator('.comparison tbody tr').count(), 2);
  assert.deepEqual(await findings(page), []);
  await picture(page, 'comparison');
  await page.getByRole('button', { name: 'End comparison' }).click();
  await page.locator('.comparison').waitFor({ state: 'detached' });
  quiet(page);
  await page.context().close();
});

test('estimates and history are downloaded', options, async () => {
  const page = await open(browser, `${daemon.address}#/tuesday`);
  await page.waitForSelector('.strip');
  const fetched = async (label) => {
    await page.getByText('Download', { exact: true }).click();
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: label }).click()]);
    return { name: download.suggestedFilename(), text: readFileSync(await download.path(), 'utf8') };
  };
  const json = await fetched('Everything (JSON)');
  assert.equal(json.name, 'tuesday.json');
  const { estimate, history, session } = JSON.parse(json.text);
  assert.equal(estimate.parameters[0].name, 'k');
  assert.equal(history.points.length, 200);
  assert.equal(session.name, 'sessions/tuesday');
  const estimates = await fetched('Estimates (CSV)');
  assert.match(estimates.text, /^parameter,unit,estimate.*\r\nk,N\/m,41\.29/);
  const points = await fetched('History (CSV)');
  assert.equal(points.text.trimEnd().split('\r\n').length, 201);
  quiet(page);
  await page.context().close();
});

test('a prediction that fails is said, and the rest goes on', options, async () => {
  daemon.fail('Predict', new Failure(9, 'too few trajectories can be integrated'));
  daemon.fail('ComputePosterior', new Failure(8, 'the daemon is short of memory'));
  const page = await open(browser, `${daemon.address}#/monday`);
  await says(page, 'No new prediction: too few trajectories can be integrated');
  await says(page, 'No new picture: the daemon is short of memory');
  await status(page, 'Live');
  assert.deepEqual(await findings(page), [], 'a picture that has never come has a name, too');
  daemon.fail('Predict', null);
  daemon.fail('ComputePosterior', null);
  await says(page, 'Measured and predicted: x', 20_000);
  await page.context().close();
});

for (const colorScheme of ['light', 'dark']) {
  for (const width of [1280, 390]) {
    test(`${colorScheme}, ${width} pixels wide: fits, and can be used by all`, options, async () => {
      const page = await open(browser, `${daemon.address}#/monday`, { colorScheme, width, height: width > 500 ? 900 : 844 });
      await status(page, 'Live');
      await page.waitForSelector('.corner[aria-label^="Posterior of"]');
      await seeAll(page);
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing sticks out');
      assert.deepEqual(await findings(page), []);
      await picture(page, `session-${colorScheme}-${width}`);
      await page.goto(`${daemon.address}#/`);
      await page.waitForSelector('.sessions tbody tr');
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing sticks out');
      assert.deepEqual(await findings(page), []);
      await picture(page, `list-${colorScheme}-${width}`);
      quiet(page);
      await page.context().close();
    });
  }
}

test('the keyboard reaches everything, and sees where it is', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Live');
  const reached = new Set();
  for (let k = 0; k < 60; ++k) {
    await page.keyboard.press('Tab');
    const name = await page.evaluate(() => {
      const { activeElement } = document;
      const { outlineStyle } = getComputedStyle(activeElement);
      return outlineStyle === 'none' && activeElement !== document.body ? `no outline: ${activeElement.outerHTML}` : activeElement.textContent || activeElement.id;
    });
    assert.doesNotMatch(name, /^no outline/);
    reached.add(name);
  }
  for (const name of ['‹ Sessions', 'Freeze', 'Whole prior', 'other', 'Download', 'Print report', 'Whole run', 'Draw now']) {
    assert.ok(reached.has(name), `${name} is reached: ${[...reached].join(' | ')}`);
  }
  await page.locator('.term').first().focus();
  await page.locator('.bubble:visible').waitFor();
  await page.keyboard.press('Escape');
  await page.locator('.bubble').waitFor({ state: 'hidden' });
  await page.context().close();
});

test('the switch goes from the system’s colours to light, dark and back', options, async () => {
  const page = await open(browser, daemon.address, { colorScheme: 'dark' });
  const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await ground();
  await page.getByRole('button', { name: 'Colours: Auto' }).click();
  const light = await ground();
  assert.notEqual(light, dark);
  await page.reload();
  assert.equal(await ground(), light);
  await page.getByRole('button', { name: 'Colours: Light' }).click();
  assert.equal(await ground(), dark);
  await page.context().close();
});
