import { existsSync } from 'node:fs';

const debians = ['/usr/bin/chromium-headless-shell', '/usr/bin/chromium'].find(existsSync);

/// How tests, figures and pictures start their browser: the one that UPSWING_CHROMIUM names, Debian's,
/// or else Playwright's own.
export const launchOptions = {
  executablePath: process.env.UPSWING_CHROMIUM ?? debians,
  args: [
    '--no-sandbox', // there is none for root, nor in most containers
    '--disable-gpu',
    // No requests to other hosts.
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
  ],
};
