// Builds dist/, which polyestd embeds. The same sources give the same bytes: names of assets are
// hashes of their contents, and nothing in them depends on the machine or the time.
import { readFileSync } from 'node:fs';

import { defineConfig } from 'vite';

// Whoever gets the page gets the licence of the package that it contains.
const licence = readFileSync(new URL('node_modules/uplot/LICENSE', import.meta.url), 'utf8');
const banner = `/*! Contains uPlot (https://github.com/leeoniya/uPlot):\n${licence.trim()}\n*/`;

export default defineConfig({
  base: './',
  esbuild: { legalComments: 'inline' },
  build: {
    target: 'es2020',
    modulePreload: { polyfill: false },  // browsers of the last years need none
    assetsInlineLimit: 0,                // the daemon's policy allows no inline script or style
    reportCompressedSize: false,
    rollupOptions: { output: { banner: (chunk) => (chunk.isEntry ? banner : '') } },
  },
  // `npm run dev` beside `npm run fake` or polyestd --web 127.0.0.1:8080.
  server: { proxy: { '/v1': process.env['POLYEST_WEB'] ?? 'http://127.0.0.1:8080' } },
});
