// The page against polyestd itself, while polyest streams a record of examples/ to it.
//
//   POLYEST_DAEMON, POLYEST_COMMAND   the programs; without them there is no test
//   POLYEST_DIST                      a folder to take the page from, in place of what is built into the daemon

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { findings, hasNoNonsense, inked, launch, missing, open as openPage, picture, quiet, says, seeAll, status, until } from './harness.mjs';

const { POLYEST_DAEMON, POLYEST_COMMAND, POLYEST_DIST } = process.env;
const source = process.env.POLYEST_SOURCE ?? fileURLToPath(new URL('../../../..', import.meta.url));
const example = (name) => join(source, 'client', 'examples', name);
const skip = missing || (POLYEST_DAEMON && POLYEST_COMMAND ? false : 'POLYEST_DAEMON and POLYEST_COMMAND name no programs');
const options = { skip, timeout: 120_000 };
const folder = mkdtempSync(join(tmpdir(), 'polyest-web-'));
const children = [];  // that a failed test may leave behind
let browser;

before(async () => { if (!skip) browser = await launch(); });
after(async () => {
  for (const child of children) child.kill('SIGKILL');
  if (!skip) await browser.close();
  rmSync(folder, { recursive: true, force: true });
});

// Starts a daemon and reads its addresses from what it prints.
async function start(...args) {
  const child = spawn(POLYEST_DAEMON, [...args], { stdio: ['ignore', 'pipe', 'pipe'] });
  children.push(child);
  let text = '';
  child.stdout.on('data', (piece) => { text += piece; });
  child.stderr.on('data', (piece) => { text += piece; });
  const read = (pattern) => pattern.exec(text)?.[1];
  await until(() => read(/web page on (\S+)/) || child.exitCode !== null, 'the daemon is ready', 30_000);
  assert.equal(child.exitCode, null, text);
  return { child, web: read(/web page on (\S+)/), server: read(/listening on (\S+)/) };
}

async function stop({ child }, signal = 'SIGTERM') {
  if (child.exitCode !== null || child.signalCode !== null) return;
  const exit = once(child, 'exit');
  child.kill(signal);
  await exit;
}

const open = (url) => openPage(browser, url, { files: POLYEST_DIST });

function stream(server, session, ...args) {
  const child = spawn(POLYEST_COMMAND, ['stream', example('oscillator.json'), example('oscillator.csv'), '--server', server, '--session', session, ...args],
                      { stdio: ['ignore', 'ignore', 'inherit'] });
  children.push(child);
  return once(child, 'exit');
}

// Streams the record, five rows at a time: slowly until `hurry` is called, so that there are new
// estimates when the page has opened, however long that takes.
function feed(server, session) {
  const child = spawn(POLYEST_COMMAND, ['stream', example('oscillator.json'), '-', '--server', server, '--session', session, '--batch', '5'],
                      { stdio: ['pipe', 'ignore', 'inherit'] });
  children.push(child);
  child.stdin.on('error', () => undefined);  // of a child that has ended; its status tells why
  const [header, ...rows] = readFileSync(example('oscillator.csv'), 'utf8').trimEnd().split('\n');
  child.stdin.write(`${header}\n`);
  let pauseMs = 120;
  const send = () => {
    child.stdin.write(rows.splice(0, 5).map((row) => `${row}\n`).join(''));
    if (rows.length > 0) setTimeout(send, pauseMs);
    else child.stdin.end();
  };
  send();
  return { end: once(child, 'exit'), hurry: () => { pauseMs = 20; } };
}

test('all panels follow a record that polyest streams', options, async () => {
  const daemon = await start('--listen', '127.0.0.1:0', '--web', '127.0.0.1:0', '--durability', 'memory');
  const feeding = feed(daemon.server, 'monday');
  const page = await open(daemon.web);
  await page.getByRole('link', { name: 'monday' }).click({ timeout: 20_000 });
  await status(page, 'Live');
  feeding.hurry();
  await page.waitForSelector('.strip[data-verdict="IDENTIFIED"]');
  await says(page, 'Measured and predicted: x');
  await page.waitForSelector('.corner[aria-label="Posterior of k, c, each alone and in pairs"]');
  await says(page, /× real time/);
  await seeAll(page);
  for (const canvas of ['.strip canvas', '.signals .chart canvas', '.split .chart canvas', '.corner canvas']) {
    assert.ok(await inked(page, canvas) > 2000, `${canvas} is drawn`);
  }
  await picture(page, 'real-light-1280');
  assert.deepEqual(await feeding.end, [0, null]);
  await says(page, '1000 samples');
  // As `polyest estimate` prints them.
  await says(page, '41.2976');
  await says(page, '0.23015');
  // The page rests ten times as long as a prediction takes, on a busy machine some seconds.
  await says(page, '94.2 %', 60_000);
  await says(page, 'The data determine every combination');
  await hasNoNonsense(page);
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  assert.match(await page.locator('pre.problem').innerText(), /^\{\s+"model": \{"builtin": "mass_spring_damper"\}/);
  await page.evaluate(() => dispatchEvent(new Event('afterprint')));
  assert.deepEqual(await findings(page), []);
  quiet(page);
  await page.context().close();
  await stop(daemon);
});

test('the page finds a daemon that was killed and restarted, and its session', options, async () => {
  // At 127.0.0.1 another program, or an attempt to connect, might take the port while no daemon has it.
  const first = await start('--listen', '127.0.0.1:0', '--web', '127.0.0.2:0', '--data-dir', join(folder, 'data'));
  await stream(first.server, 'monday', '--batch', '50');
  const page = await open(`${first.web}#/monday`);
  await says(page, '1000 samples');
  const value = await page.locator('.strip .value').first().innerText();
  await stop(first, 'SIGKILL');
  await status(page, 'Stream lost');
  const second = await start('--listen', '127.0.0.1:0', '--web', new URL(first.web).host, '--data-dir', join(folder, 'data'));
  await status(page, 'Idle', 30_000);
  assert.equal(await page.locator('.strip .value').first().innerText(), value);
  await page.context().close();
  await stop(second);
});

test('a reader’s token sees the session', options, async () => {
  const make = spawn(POLYEST_DAEMON, ['--new-token', 'eye:bench:reader'], { stdio: ['ignore', 'pipe', 'pipe'] });
  let [secret, line] = ['', ''];
  make.stdout.on('data', (piece) => { secret += piece; });
  make.stderr.on('data', (piece) => { line += piece; });
  await once(make, 'close');
  const tokens = join(folder, 'tokens');
  writeFileSync(tokens, line, { mode: 0o600 });
  const daemon = await start('--listen', '127.0.0.1:0', '--web', '127.0.0.1:0', '--durability', 'memory', '--tokens', tokens);
  const page = await open(daemon.web);
  await says(page, 'This daemon asks for a token');
  await page.getByLabel('Access token').fill(secret.trim());
  await page.getByRole('button', { name: 'Continue' }).click();
  await says(page, 'There are no sessions yet');
  quiet(page);
  await page.context().close();
  await stop(daemon);
});
