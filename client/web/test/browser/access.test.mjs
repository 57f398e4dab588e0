// Tokens: none, a wrong one, a reader's; where they go, and where they do not.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { FakeDaemon, Failure } from '../fake/fake_daemon.mjs';
import { findings, launch, missing, open, picture, quiet, says, status } from './harness.mjs';

const TOKEN = 'reader-0123456789';
const daemon = new FakeDaemon({ tokens: [TOKEN] });
let browser;

before(async () => {
  if (missing) return;
  daemon.add('monday', { count: 60, hasWriter: true });
  await daemon.start();
  browser = await launch();
});
after(async () => {
  if (missing) return;
  await browser.close();
  await daemon.stop();
});
const options = { skip: missing || false };

async function enter(page, token) {
  await page.getByLabel('Access token').fill(token);
  await page.getByRole('button', { name: 'Continue' }).click();
}

test('a daemon with tokens asks for one, and shows nothing before', options, async () => {
  const page = await open(browser, daemon.address);
  await says(page, 'This daemon asks for a token');
  assert.deepEqual(await findings(page), []);
  await picture(page, 'token');
  await enter(page, 'a wrong one');
  await says(page, 'A token has letters, digits and signs only');
  await enter(page, 'wrong');
  await says(page, 'This token is not accepted');
  await enter(page, TOKEN);
  await page.getByRole('link', { name: 'monday' }).click();
  await page.waitForSelector('.strip');
  quiet(page);
  await page.context().close();
});

test('the token stays in this tab, in a header, and nowhere else', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await enter(page, TOKEN);
  await page.waitForSelector('.strip');
  await page.reload();
  await page.waitForSelector('.strip');
  assert.ok(daemon.requests.every(({ url }) => !url.includes(TOKEN)), 'not in an address');
  assert.ok(daemon.requests.some(({ authorization }) => authorization === `Bearer ${TOKEN}`));
  const kept = await page.evaluate(() => ({ local: JSON.stringify(localStorage), cookies: document.cookie, session: JSON.stringify(sessionStorage) }));
  assert.ok(!kept.local.includes(TOKEN) && !kept.cookies.includes(TOKEN) && kept.session.includes(TOKEN));
  const other = await page.context().newPage();
  await other.goto(daemon.address);
  await says(other, 'This daemon asks for a token');
  await page.getByRole('button', { name: 'Forget token' }).click();
  await says(page, 'This daemon asks for a token');
  await page.context().close();
});

test('a reader’s token is enough: nothing on the page asks for more', options, async () => {
  // What only writers and administrators may do is refused.
  const refused = ['CreateSession', 'DeleteSession', 'ExportSession', 'ImportSession', 'AddMeasurements', 'StreamMeasurements'];
  for (const method of refused) daemon.fail(method, new Failure(7, 'this takes the role writer'));
  daemon.requests.length = 0;
  const page = await open(browser, `${daemon.address}#/monday`);
  await enter(page, TOKEN);
  await page.waitForSelector('.corner[aria-label^="Posterior of"]');
  for (const name of ['Freeze', 'Freeze', 'Whole prior', 'Whole run', 'Draw now']) {
    await page.getByRole('button', { name }).click();
  }
  for (const label of ['Everything (JSON)', 'Estimates (CSV)', 'History (CSV)']) {
    await page.getByText('Download', { exact: true }).click();
    await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: label }).click()]);
  }
  await page.getByRole('link', { name: '‹ Sessions' }).click();
  await page.waitForSelector('.sessions tbody tr');
  const called = new Set(daemon.requests.map(({ url }) => url.split('/').pop()));
  assert.deepEqual(refused.filter((method) => called.has(method)), []);
  assert.equal(await page.locator('.trouble:visible').count(), 0);
  quiet(page);
  await page.context().close();
});

test('a token that is withdrawn while a session is watched is said to be refused', options, async () => {
  const page = await open(browser, `${daemon.address}#/monday`);
  await enter(page, TOKEN);
  await page.waitForSelector('.strip');
  daemon.tokens = [];
  daemon.sessions.get('monday').end(16, 'the token is not known');
  await says(page, 'This token is not accepted');
  daemon.tokens = [TOKEN];
  await page.context().close();
});

test('a session that the token may not see is said to be so', options, async () => {
  const page = await open(browser, daemon.address);
  await enter(page, TOKEN);
  await page.waitForSelector('.sessions tbody tr');
  daemon.fail('GetSession', new Failure(7, 'the token is another tenant’s now'));
  await page.getByRole('link', { name: 'monday' }).click();
  await status(page, 'No access');
  await says(page, 'another tenant');
  daemon.fail('GetSession', null);
  await page.context().close();
});
