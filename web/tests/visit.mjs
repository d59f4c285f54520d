import { chromium } from '@playwright/test';
import { preview } from 'vite';
import { launchOptions } from './chromium.mjs';

/// Serves the built page and opens it in fresh browsers, for figures and pictures.

export async function serve() {
  const outDir = process.env.UPSWING_PAGE ?? '../build/web';
  const server = await preview({ preview: { port: 0 }, build: { outDir } });
  return { address: server.resolvedUrls.local[0], close: () => server.close() };
}

/// Calls use(page) in a browser that has nothing cached, and returns what it returns.
export async function visit(options, use) {
  const browser = await chromium.launch(launchOptions);
  const page = await browser.newPage(options);
  const result = await use(page);
  await browser.close();
  return result;
}

export async function ready(page) {
  await page.waitForFunction(
    () => globalThis.upswing && !document.querySelector('fieldset:disabled'),
  );
}
