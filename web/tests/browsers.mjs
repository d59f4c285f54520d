// npm run browsers: trains the same recipe in Chromium, in Firefox and in Node, and prints the SHA-256 of each
// policy. Firefox is the program `firefox-esr` or `firefox`, driven by WebDriver BiDi, for which Node 20 needs
// --experimental-websocket.
import { spawn } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createServer } from 'vite';
import { serve, visit } from './visit.mjs';

const AGENT = 'fast';
const SEED = 42;
const SETTINGS = { balance_weight: 0 };
const recipe = new URLSearchParams({ learn: AGENT, seed: SEED, ...SETTINGS });

/// Runs in the page: the steps of its training and the SHA-256 of its policy at the end.
async function hashInPage() {
  const wait = () => new Promise((resolve) => setTimeout(resolve, 200));
  while (!globalThis.upswing?.learn.sessions[0]?.last?.finished) await wait();
  const { policy, steps } = upswing.learn.sessions[0];
  const bytes = new Uint8Array(await crypto.subtle.digest('SHA-256', policy));
  return `${steps} steps, ${[...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('')}`;
}

async function inChromium(address) {
  return visit({}, async (page) => {
    await page.goto(address);
    return `${await page.context().browser().version()}: ${await page.evaluate(hashInPage)}`;
  });
}

/// Firefox accepts commands on a socket and prints its address.
async function inFirefox(address) {
  const profile = mkdtempSync(join(tmpdir(), 'upswing-firefox-'));
  const program = process.env.UPSWING_FIREFOX ?? 'firefox-esr';
  const given = ['--headless', '--no-remote', '--profile', profile, '--remote-debugging-port', '0'];
  const firefox = spawn(program, given, { stdio: ['ignore', 'ignore', 'pipe'] });
  const endpoint = await new Promise((resolve, reject) => {
    let text = '';
    firefox.on('error', reject);
    firefox.stderr.on('data', (data) => {
      const found = /WebDriver BiDi listening on (\S+)/.exec((text += data));
      if (found) resolve(found[1]);
    });
  });
  const socket = new WebSocket(`${endpoint}/session`);
  await new Promise((resolve) => (socket.onopen = resolve));
  const waiting = new Map();
  socket.onmessage = ({ data }) => {
    const { id, type, result, message } = JSON.parse(data);
    const { resolve, reject } = waiting.get(id) ?? {};
    if (type === 'success') resolve?.(result);
    else if (type === 'error') reject?.(new Error(message));
  };
  const command = (method, params) =>
    new Promise((resolve, reject) => {
      const id = waiting.size + 1;
      waiting.set(id, { resolve, reject });
      socket.send(JSON.stringify({ id, method, params }));
    });
  const { capabilities } = await command('session.new', { capabilities: {} });
  const { contexts } = await command('browsingContext.getTree', {});
  const { context } = contexts[0];
  await command('browsingContext.navigate', { context, url: address, wait: 'complete' });
  const { result } = await command('script.callFunction', {
    functionDeclaration: String(hashInPage),
    target: { context },
    awaitPromise: true,
  });
  firefox.kill();
  await new Promise((resolve) => firefox.on('exit', resolve));
  rmSync(profile, { recursive: true });
  return `${capabilities.browserVersion}: ${result.value}`;
}

async function inNode() {
  const server = await createServer({ server: { middlewareMode: true }, appType: 'custom' });
  const { Core } = await server.ssrLoadModule('/src/core.ts');
  const { Learner } = await server.ssrLoadModule('/src/learn/learner.ts');
  const wasm = readFileSync(new URL('../wasm/core.wasm', import.meta.url));
  const learner = new Learner(
    await Core.start(await WebAssembly.compile(wasm)),
    AGENT,
    SEED,
    SETTINGS,
  );
  while (learner.run(1000));
  const { steps } = learner.report();
  const hash = createHash('sha256').update(Buffer.from(learner.policy())).digest('hex');
  await server.close();
  return `${process.version}: ${steps} steps, ${hash}`;
}

const server = await serve();
const address = `${server.address}#${recipe}`;
console.log(`#${recipe}`);
console.log(`Chromium ${await inChromium(address)}`);
console.log(`Firefox ${await inFirefox(address)}`);
console.log(`Node ${await inNode()}`);
await server.close();
