// dist/ is what a build of these sources makes, byte by byte: polyestd embeds it.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

const root = fileURLToPath(new URL('..', import.meta.url));

const files = (folder, under = '') =>
  readdirSync(join(folder, under), { withFileTypes: true })
    .flatMap((entry) => (entry.isDirectory() ? files(folder, join(under, entry.name)) : [join(under, entry.name)])).sort();

const built = mkdtempSync(join(tmpdir(), 'polyest-dist-'));
test.after?.(() => rmSync(built, { recursive: true, force: true }));

test('a fresh build has the bytes of dist; if not: npm ci && npm run build', () => {
  execFileSync('npx', ['tsc', '--noEmit'], { cwd: root, stdio: 'inherit' });
  execFileSync('npx', ['vite', 'build', '--logLevel', 'error', '--outDir', built, '--emptyOutDir'], { cwd: root, stdio: 'inherit' });
  const kept = join(root, 'dist');
  assert.deepEqual(files(built), files(kept));
  for (const file of files(kept)) {
    assert.ok(readFileSync(join(built, file)).equals(readFileSync(join(kept, file))), `${file} differs`);
  }
});

test('dist has no script or style but in files, no address of others, and stays small', () => {
  const page = readFileSync(join(root, 'dist', 'index.html'), 'utf8');
  assert.doesNotMatch(page, /<script(?![^>]*\ssrc=)[^>]*>|<style|\sstyle=|\son[a-z]+=/);
  const all = files(join(root, 'dist')).map((file) => readFileSync(join(root, 'dist', file), 'utf8'));
  for (const text of all) {
    const addresses = [...text.matchAll(/https?:\/\/[^\s"'`)]+/g)].map(([address]) => address);
    // The name of SVG's elements and that of a package in its licence are no addresses that are called.
    const known = ['http://www.w3.org/2000/svg', 'https://github.com/leeoniya/uPlot'];
    assert.deepEqual(addresses.filter((address) => !known.some((name) => address.startsWith(name))), []);
  }
  assert.match(all.join(''), /uPlot[^]*Permission is hereby granted[^]*WITHOUT WARRANTY OF ANY KIND/, 'the licence of uPlot');
  assert.ok(all.join('').length < 200_000, 'small enough to be part of the daemon');
});
