import { afterEach, expect, test } from 'vitest';
import { Asker, STRANGE } from './asker';
import type { Refusal } from './asker';

const STATES = Float64Array.from([0, 0, 0, 0, 0.5]);

let asker: Asker;
afterEach(() => asker.close());

/// The first refusal after `send` has answered a question with its own messages.
function refusal(send: (port: MessagePort) => void): Promise<Refusal> {
  const { port1, port2 } = new MessageChannel();
  return new Promise((resolve) => {
    asker = new Asker(port1, resolve);
    void asker.ask(STATES);
    send(port2);
  });
}

test('a torque answers a question', async () => {
  const { port1, port2 } = new MessageChannel();
  asker = new Asker(port1, ({ text }) => expect.fail(text));
  port2.onmessage = ({ data }) => port2.postMessage(Float64Array.from([data[4]]));
  port2.postMessage('ready');
  expect([...(await asker.ask(STATES))]).toEqual([0.5]);
  port2.close();
});

test.each([
  ['a flood', Array<string>(1000).fill('x')],
  ['NaN', [Float64Array.from([NaN])]],
  ['several torques', [Float64Array.from([1, 2])]],
  ['another kind of numbers', [Float32Array.from([1])]],
  ['a text as the reason', [[1, '<b>x</b>']]],
  ['a text as the time', [['1', 'NaN']]],
  ['a second start', ['ready', 'ready']],
  ['nothing', [null]],
])('%s is refused once', async (_, messages) => {
  const refused = await refusal((port) => messages.forEach((message) => port.postMessage(message)));
  expect(refused).toEqual({ text: STRANGE, returned: false });
});

test.each([
  [[0.5, 'NaN'], 'it returned NaN at t = 0.50 s'],
  [[0.5, 'string'], 'it returned string instead of a number at t = 0.50 s'],
])('%j names the value', async (message, text) => {
  const refused = await refusal((port) => port.postMessage(message));
  expect(refused).toEqual({ text, returned: true });
});
