import { defineConfig } from '@playwright/test';
import { launchOptions } from './tests/chromium.mjs';

/// The built page in Chromium. tools/web_test sets the build, the port and the browser.
const page = process.env.UPSWING_PAGE ?? '../build/web';
const port = Number(process.env.UPSWING_PAGE_PORT ?? 4174);

export default defineConfig({
  testDir: 'tests',
  testMatch: '*.page.ts',
  outputDir: 'node_modules/.playwright',
  workers: 2,
  forbidOnly: process.env.UPSWING_REQUIRE_WEB === '1',
  reporter: 'list',
  // Enough for a machine twenty times slower than two idle cores. Passing tests do not wait.
  timeout: 2_400_000,
  expect: { timeout: 300_000 },
  use: {
    serviceWorkers: 'block', // a page from before would answer
    baseURL: `http://127.0.0.1:${port}/`,
    launchOptions,
    actionTimeout: 300_000,
  },
  webServer: {
    command: `vite preview --outDir "${page}" --host 127.0.0.1 --port ${port} --strictPort`,
    port,
    reuseExistingServer: false,
  },
});
