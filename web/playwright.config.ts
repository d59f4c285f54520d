import { existsSync } from 'node:fs';
import { defineConfig } from '@playwright/test';

/// The built page in Chromium. tools/web_test says which build, on which port, in which browser.
const page = process.env.UPSWING_PAGE ?? '../build/web';
const port = Number(process.env.UPSWING_PAGE_PORT ?? 4174);
const debians = '/usr/bin/chromium';
const chromium = process.env.UPSWING_CHROMIUM ?? (existsSync(debians) ? debians : undefined);

export default defineConfig({
  testDir: 'tests',
  testMatch: '*.page.ts',
  outputDir: 'node_modules/.playwright',
  workers: 1,
  forbidOnly: process.env.UPSWING_REQUIRE_WEB === '1',
  reporter: 'list',
  use: {
    baseURL: `http://127.0.0.1:${port}/`,
    launchOptions: {
      ...(chromium ? { executablePath: chromium } : {}), // else Playwright's own
      args: [
        '--no-sandbox', // there is none for root, nor in most containers
        '--disable-gpu',
        // No word to anyone else.
        '--disable-quic',
        '--no-first-run',
        '--disable-background-networking',
        '--disable-component-update',
        '--disable-sync',
      ],
    },
  },
  webServer: {
    command: `vite preview --outDir "${page}" --host 127.0.0.1 --port ${port} --strictPort`,
    port,
    reuseExistingServer: false,
  },
});
