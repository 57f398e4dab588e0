// What tests in a browser share: Debian's Chromium, a page that notes every complaint, and waits
// that end as soon as what they wait for is there.

import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { extname, join } from 'node:path';
import { chromium } from 'playwright-core';

const CHROMIUM = process.env.POLYEST_CHROMIUM ?? '/usr/bin/chromium';
const axeSource = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

// Why there can be no test; empty if there can.
export const missing = existsSync(CHROMIUM) ? '' : `there is no ${CHROMIUM}`;

export const launch = () => chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--js-flags=--expose-gc'] });

// Opens `url`. The page's `complaints` are violations of its policy, errors, and requests to others.
// `files`: a folder to take the page itself from, in place of what the daemon has.
export async function open(browser, url, { width = 1280, height = 900, colorScheme = 'light', files, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme, ...options });
  const page = await context.newPage();
  page.complaints = [];
  page.on('console', (message) => {
    // A call that fails is told by the browser; tests of failures expect it.
    if (message.type() === 'error' && !/Failed to load resource|net::ERR/.test(message.text())) page.complaints.push(message.text());
  });
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  page.on('request', (request) => {
    const { origin, protocol } = new URL(request.url());
    if (/^https?:$/.test(protocol) && origin !== new URL(url).origin) page.complaints.push(`request to ${request.url()}`);
  });
  await page.addInitScript(() => {
    document.addEventListener('securitypolicyviolation', (event) => console.error(`policy: ${event.violatedDirective} ${event.blockedURI}`));
  });
  if (files) await serve(page, url, files);
  await page.goto(url);
  return page;
}

const TYPES = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };

// Answers for the page's files, with the policy of the daemon.
async function serve(page, url, folder) {
  const policy = (await fetch(url)).headers.get('content-security-policy') ?? '';
  await page.route(({ pathname }) => pathname === '/' || pathname.startsWith('/assets/'), (route) => {
    const { pathname } = new URL(route.request().url());
    const file = pathname === '/' ? 'index.html' : pathname;
    const headers = { 'content-security-policy': policy };
    return route.fulfill({ body: readFileSync(join(folder, file)), contentType: TYPES[extname(file)] ?? 'text/plain', headers });
  });
}

export const quiet = (page) => assert.deepEqual(page.complaints, []);

// Waits until the page says `text` somewhere.
export const says = (page, text, timeout = 20_000) => page.getByText(text).filter({ visible: true }).first().waitFor({ timeout });

export const status = (page, label, timeout = 30_000) => page.waitForSelector(`body[data-status="${label}"]`, { timeout });

// Waits until `condition` holds.
export async function until(condition, what, timeoutMs = 20_000) {
  const end = Date.now() + timeoutMs;
  while (!(await condition())) {
    if (Date.now() > end) assert.fail(`not within ${timeoutMs} ms: ${what}`);
    await new Promise((resolve) => { setTimeout(resolve, 25); });
  }
}

// Passes over the page, so that every chart is drawn.
export async function seeAll(page) {
  const height = await page.evaluate(() => document.documentElement.scrollHeight);
  for (let y = 0; y < height; y += 500) {
    await page.evaluate((to) => scrollTo(0, to), y);
    await page.waitForTimeout(60);
  }
  await page.evaluate(() => scrollTo(0, 0));
}

// How many of the pixels of a canvas have a colour.
export const inked = (page, selector) => page.locator(selector).first().evaluate((canvas) => {
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 3; i < data.length; i += 4) if (data[i] > 0) count += 1;
  return count;
});

// The serious findings of axe-core, with the elements. It is run from outside of the page, whose
// policy allows no other scripts.
export async function findings(page) {
  await page.evaluate(axeSource);
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }));
  return violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(' ')).slice(0, 3).join(', ')}`);
}

// No text that a failed computation leaves behind.
export async function hasNoNonsense(page) {
  const text = await page.evaluate(() => document.body.innerText + [...document.querySelectorAll('[aria-label]')].map((e) => e.getAttribute('aria-label')).join('\n'));
  assert.doesNotMatch(text, /\bNaN\b|undefined|\[object|Infinity|\bnull\b/);
}

// Writes a picture if a folder for pictures is given.
export async function picture(page, name) {
  const folder = process.env.POLYEST_PICTURES;
  if (!folder) return;
  mkdirSync(folder, { recursive: true });
  await seeAll(page);
  await page.screenshot({ path: join(folder, `${name}.png`), fullPage: true });
}
