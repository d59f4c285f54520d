import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { chromium } from '@playwright/test';
import { preview } from 'vite';
import { launchOptions } from './chromium.mjs';

/// Serves the built page and opens it in fresh browsers, for figures and pictures.

const outDir = process.env.UPSWING_PAGE ?? '../build/web';
const TYPES = {
  html: 'text/html',
  js: 'text/javascript',
  css: 'text/css',
  json: 'application/json',
  svg: 'image/svg+xml',
  wasm: 'application/wasm',
};

/// Compresses responses, as web servers do.
function compress({ url }, response, next) {
  const path = new URL(url, 'http://localhost').pathname.replace(/\/$/, '/index.html');
  const file = join(outDir, path);
  if (!existsSync(file)) return next();
  const type = TYPES[path.split('.').at(-1)] ?? 'application/octet-stream';
  response.writeHead(200, { 'content-type': type, 'content-encoding': 'gzip' });
  response.end(gzipSync(readFileSync(file)));
}

export async function serve() {
  const plugin = {
    name: 'compress',
    configurePreviewServer: ({ middlewares }) => void middlewares.use(compress),
  };
  const server = await preview({ preview: { port: 0 }, build: { outDir }, plugins: [plugin] });
  return { address: server.resolvedUrls.local[0], close: () => server.close() };
}

/// Calls use(page) in a browser with an empty cache, and returns its result.
export async function visit(options, use) {
  const browser = await chromium.launch(launchOptions);
  const page = await browser.newPage(options);
  const result = await use(page);
  await browser.close();
  return result;
}

/// Waits until the page has its agent and MuJoCo.
export async function ready(page) {
  await page.waitForFunction(
    () => globalThis.upswing?.isComplete && !document.querySelector('fieldset:disabled'),
  );
}
