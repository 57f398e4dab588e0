// What the page does when the daemon goes, comes back, refuses, or has nothing to show.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { FakeDaemon, Failure } from '../fake/fake_daemon.mjs';
import { findings, hasNoNonsense, launch, missing, open, picture, quiet, says, status, until } from './harness.mjs';

let browser;
before(async () => { if (!missing) browser = await launch(); });
after(async () => { if (!missing) await browser.close(); });
const options = { skip: missing || false };

// Runs `body` with a daemon of its own.
async function withDaemon(body, settings) {
  const daemon = new FakeDaemon(settings);
  await daemon.start();
  try {
    await body(daemon);
  } finally {
    await daemon.stop();
  }
}

const value = (page) => page.locator('.strip .value').first().innerText();

test('a daemon that is killed and restarted is found again, with all that came in between', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 3, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  const first = await value(page);
  session.push();
  await until(async () => (await value(page)) !== first, 'a new estimate');
  await status(page, 'Live');
  const before = await value(page);
  await daemon.stop();
  await status(page, 'Stream lost');
  await says(page, /The (daemon cannot be reached|connection broke off)\. Trying again/);
  assert.equal(await value(page), before, 'what was known stays in sight');
  await page.getByRole('button', { name: 'Try now' }).waitFor();
  assert.deepEqual(await findings(page), []);
  session.count += 80;
  await daemon.start();
  // The page may find it by itself, and hide the button, at this very moment.
  await page.locator('button', { hasText: 'Try now' }).dispatchEvent('click');
  await until(async () => (await value(page)) !== before, 'newer estimates');
  session.push();
  await status(page, 'Live');
  quiet(page);
  await page.context().close();
}));

test('it is found again without anybody doing anything', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 30, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  await daemon.stop();
  await status(page, 'Stream lost');
  await daemon.start();
  await page.waitForSelector('body:not([data-status="Stream lost"])');
  session.push();
  await status(page, 'Live');
  await page.context().close();
}));

test('a daemon that drains ends the stream, and the page comes back', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 30, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  await until(() => session.watchers.size === 1, 'a watcher');
  // Calls are refused until the page has been seen to say so.
  daemon.fail('GetSession', new Failure(14, 'the daemon is shutting down'));
  session.end(14, 'the daemon is shutting down');
  await says(page, /The daemon is shutting down\. Trying again/);
  daemon.fail('GetSession', null);
  await until(() => session.watchers.size === 1, 'a new stream');
  assert.equal(session.watchers.size, 1);
  await page.context().close();
}));

test('attempts become rarer while the daemon is away', options, () => withDaemon(async (daemon) => {
  daemon.add('monday', { count: 30 });
  daemon.fail('GetSession', new Failure(14, 'not yet'));
  const page = await open(browser, `${daemon.address}#/monday`);
  const attempts = () => daemon.requests.filter(({ url }) => url.endsWith('/GetSession')).map(({ at }) => at);
  await until(() => attempts().length >= 4, 'four attempts', 20_000);
  // Pauses of ½, 1, 2 s, each a quarter shorter or longer; timers may be a little early.
  const [a, b, c, d] = attempts();
  assert.ok(b - a > 370 && c - b > 740 && d - c > 1490, `pauses of ${b - a}, ${c - b}, ${d - c} ms`);
  await page.context().close();
}));

test('a session that is deleted while it is watched is said to be so', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 30, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  await until(() => session.watchers.size === 1, 'a watcher');
  daemon.delete('monday');
  await status(page, 'Deleted');
  await says(page, 'There is no session monday any more.');
  assert.ok(await page.locator('.strip').first().isVisible(), 'its last estimate stays in sight');
  const calls = daemon.requests.length;
  await page.waitForTimeout(1500);
  assert.ok(daemon.requests.length <= calls + 1, 'it is not asked for any more');
  await page.context().close();
}));

test('a session that never was is said to be missing', options, () => withDaemon(async (daemon) => {
  const page = await open(browser, `${daemon.address}#/nobody`);
  await says(page, 'There is no session nobody');
  await page.getByRole('link', { name: 'All sessions' }).click();
  await says(page, 'There are no sessions yet');
  assert.deepEqual(await findings(page), []);
  await picture(page, 'empty');
  await page.context().close();
}));

test('a session without data waits, and begins when data come', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 0, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Waiting for data');
  assert.deepEqual(await findings(page), []);
  await picture(page, 'waiting');
  session.push();
  await status(page, 'Live');
  await page.waitForSelector('.strip .value');
  quiet(page);
  await page.context().close();
}));

test('measurements without an estimate are no estimate', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 5 });
  session.override = { samples: '0' };  // the prior alone
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'No estimate yet');
  await page.context().close();
}));

test('a daemon that is behind is not asked for predictions', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 30, hasWriter: true, unprocessed: 40 });
  const page = await open(browser, `${daemon.address}#/monday`);
  await says(page, 'Waits until the daemon has computed');
  const asked = () => daemon.requests.some(({ url }) => /Predict|ComputePosterior/.test(url));
  for (let k = 0; k < 5; ++k) {
    session.push();
    await page.waitForTimeout(100);
  }
  assert.equal(asked(), false);
  session.unprocessed = 0;
  await says(page, 'Measured and predicted: x');
  assert.equal(await page.getByText('Waits until').filter({ visible: true }).count(), 0);
  await page.context().close();
}));

test('the load is asked for without the problem, which the page keeps', options, () => withDaemon(async (daemon) => {
  daemon.add('monday', { count: 30, hasWriter: true });
  const page = await open(browser, `${daemon.address}#/monday`);
  await status(page, 'Live');
  const asked = () => daemon.requests.filter(({ url }) => url.endsWith('/GetSession')).map(({ body }) => body.omitProblem === true);
  await until(() => asked().length >= 3, 'the load twice', 20_000);
  assert.deepEqual(asked().slice(0, 3), [false, true, true]);
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  assert.match(await page.locator('pre.problem').textContent(), /"model"/);
  await page.context().close();
}));

test('a tab that is not seen asks for no predictions, until it is seen', options, () => withDaemon(async (daemon) => {
  daemon.add('monday', { count: 30 });
  const page = await open(browser, 'about:blank');
  await page.addInitScript(() => {
    globalThis.isHidden = true;
    Object.defineProperty(document, 'hidden', { get: () => globalThis.isHidden });
  });
  await page.goto(`${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  await page.waitForTimeout(600);
  assert.ok(!daemon.requests.some(({ url }) => /Predict|ComputePosterior/.test(url)));
  await page.evaluate(() => {
    globalThis.isHidden = false;
    document.dispatchEvent(new Event('visibilitychange'));
  });
  await says(page, 'Measured and predicted: x');
  await page.context().close();
}));

test('numbers that are none are dashes', options, () => withDaemon(async (daemon) => {
  const session = daemon.add('monday', { count: 30, hasWriter: true });
  const [k, c] = session.estimate().parameters;
  session.override = {
    parameters: [{ ...k, map: 'NaN', stdDev: 'NaN', lower95: 'NaN', upper95: 'Infinity' }, { ...c, stdDev: 'Infinity', contraction: 'NaN' }],
    covariance: ['NaN', 'NaN', 'NaN', 'NaN'],
    channels: [{ output: 'x', chiSquared: 'NaN', noiseStdDev: 'NaN', lag1Correlation: 'NaN', effectiveSamples: 'NaN', samples: '7' }],
    expansion: { residualToNoise: 'NaN' },
  };
  const page = await open(browser, `${daemon.address}#/monday`);
  await page.waitForSelector('.strip');
  session.push(3);
  await says(page, 'Measured and predicted: x');
  assert.equal(await value(page), '–');
  await hasNoNonsense(page);
  quiet(page);
  await page.context().close();
}));

test('fifty sessions are listed in pages, and found by name and state', options, () => withDaemon(async (daemon) => {
  for (let k = 0; k < 49; ++k) daemon.add(`run-${String(k).padStart(2, '0')}`, { count: 20 + k, loaded: k % 3 === 0 });
  daemon.add('slow', { count: 20, hasWriter: true, unprocessed: 40 });
  const page = await open(browser, daemon.address);
  await says(page, '50 sessions, 1 measuring now.');
  const rows = () => page.locator('.sessions tbody tr').count();
  assert.equal(await rows(), 15);
  assert.match(await page.locator('.sessions tbody tr').first().innerText(), /slow\s+Behind/);
  for (const range of ['16–30 of 50', '31–45 of 50', '46–50 of 50']) {
    await page.getByRole('button', { name: 'Next' }).click();
    await says(page, range);
  }
  assert.ok(await page.getByRole('button', { name: 'Next' }).isDisabled());
  await picture(page, 'fifty');
  await page.getByLabel('Search').fill('behind');
  await until(async () => (await rows()) === 1, 'one session found');
  await page.getByLabel('Search').fill('run-4');
  await until(async () => (await rows()) === 9, 'nine sessions found');
  await page.getByLabel('Search').fill('nothing');
  await says(page, 'No session has this name or state.');
  await page.getByLabel('Search').fill('run-07');
  await page.getByRole('link', { name: 'run-07' }).click();
  await page.waitForSelector('.strip');
  daemon.add('late', { count: 1 });
  await page.getByRole('link', { name: '‹ Sessions' }).click();
  await says(page, '51 sessions');
  quiet(page);
  await page.context().close();
}));

test('a daemon with hundreds of sessions is read page by page', options, () => withDaemon(async (daemon) => {
  for (let k = 0; k < 450; ++k) daemon.add(`run-${k}`, { count: 2 });
  const page = await open(browser, daemon.address);
  await says(page, '450 sessions, none measuring now.');
  assert.ok(daemon.requests.filter(({ url }) => url.endsWith('/ListSessions')).length >= 3);
  await page.context().close();
}));
