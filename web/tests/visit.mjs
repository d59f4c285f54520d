import { chromium } from '@playwright/test';
import { preview } from 'vite';

/// Serves the built page and opens it in fresh browsers, for figures and pictures.

export async function serve() {
  const outDir = process.env.UPSWING_PAGE ?? '../build/web';
  const server = await preview({ preview: { port: 0 }, build: { outDir } });
  return { address: server.resolvedUrls.local[0], close: () => server.close() };
}

/// Calls visit(page) in a browser that has nothing cached, and returns what it returns.
export async function visit(options, use) {
  const browser = await chromium.launch({
    executablePath: process.env.UPSWING_CHROMIUM ?? '/usr/bin/chromium', // Debian's
    args: ['--no-sandbox', '--disable-gpu'],
  });
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
