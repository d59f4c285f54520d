import { existsSync } from 'node:fs';

const debians = ['/usr/bin/chromium-headless-shell', '/usr/bin/chromium'].find(existsSync);

/// The browser of tests, figures and pictures: UPSWING_CHROMIUM, Debian's Chromium, or else
/// Playwright's own.
export const launchOptions = {
  executablePath: process.env.UPSWING_CHROMIUM ?? debians,
  args: [
    '--no-sandbox', // root and most containers have none
    '--disable-gpu',
    // Forbids requests to other hosts.
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
  ],
};
