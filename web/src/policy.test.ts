import { describe, expect, test } from 'vitest';
import { changed as changedFile, fileOf, float32Of, withMetadata } from '../tests/file';
import type { Parts } from '../tests/file';
import { readPolicy } from '../tests/program';
import { NOMINAL } from './pendulum';
import { Policy } from './policy';
import { BadInput } from './bad_input';

/// Files from strangers are refused with a reason.

const { size: _, ...parameters } = NOMINAL;

const DATA = new Uint8Array(new Float32Array([1, 2, 3, 4]).buffer);
const tensor = (shape: unknown, offsets: unknown, dtype: unknown = 'F32') => ({
  x: { dtype, shape, data_offsets: offsets },
});

test.each<[string, Record<string, unknown> | string]>([
  ['not JSON', 'hello'],
  ['a header that is a list', '[1]'],
  ['metadata that are no text', { __metadata__: { a: 1 } }],
  ['metadata that are a list', { __metadata__: [] }],
  ['a tensor that is null', { x: null }],
  ['an unknown type', tensor([4], [0, 16], 'F16')],
  ['a type that every object has', tensor([4], [0, 16], 'constructor')],
  ['a negative size', tensor([-4], [0, 16])],
  ['a size that is no whole number', tensor([0.5], [0, 2])],
  ['sizes whose product is too large', tensor([1e7, 1e7, 1e7], [0, 16])],
  ['a shape that is no list', tensor('4', [0, 16])],
  ['offsets behind the end', tensor([4], [4, 20])],
  ['offsets that go backwards', tensor([0], [8, 4])],
  ['three offsets', tensor([4], [0, 16, 16])],
  ['fewer bytes than the shape asks for', tensor([4], [0, 12])],
  ['a gap', tensor([2], [8, 16])],
  ['bytes outside of all tensors', tensor([2], [0, 8])],
  [
    'tensors that share bytes',
    { ...tensor([4], [0, 16]), y: { dtype: 'F32', shape: [2], data_offsets: [8, 16] } },
  ],
])('refuses %s', (_, header) => {
  const read = () => new Policy(fileOf(header, DATA));
  expect(read).toThrow(BadInput);
  expect(read).toThrow('not a valid safetensors file');
});

test('refuses a file that is cut off', () => {
  expect(() => new Policy(new ArrayBuffer(0))).toThrow('expected at least 8 bytes, got 0');
  const long = fileOf({});
  new DataView(long).setBigUint64(0, 2n ** 63n, true);
  expect(() => new Policy(long)).toThrow('header length');
});

describe('a policy', () => {
  const original = readPolicy('fast');
  const changed = (change: (parts: Parts) => void) => changedFile(original, change);
  const metadata = (key: string, text: string | undefined) => withMetadata(original, key, text);

  test('is read, and computes what the C++ program did', () => {
    const policy = new Policy(changed(() => {}));
    expect(policy.controller.selfCheckError).toBeLessThan(1e-4);
    expect(policy.controller.text).toContain('→9');
    expect(policy.trainedRange('mass1')).toEqual([1, 1]);
  });

  test.each([
    ['format', 'other'],
    ['format_version', '2'],
    ['output', 'mean'],
    ['control_period', '2'],
    ['control_period', '0.0005'],
    ['model', '<mujoco/>'],
    ['network', 'x'],
    ['network', 'null'],
    [
      'network',
      '{"inputs":8,"actions":9,"hidden":[1000000],"head":32,"dueling":true,"layer_norm":true}',
    ],
    [
      'network',
      '{"inputs":9,"actions":9,"hidden":[48,32],"head":32,"dueling":true,"layer_norm":true}',
    ],
    ['plant', '{"mass1":"heavy"}'],
    ['plant', 'null'],
    ...(['mass1', 'mass2', 'length1', 'length2', 'gravity', 'torque_limit'] as const).flatMap(
      (name) =>
        [0, -1, 1e9, 1e-300].map((value): [string, string] => [
          'plant',
          JSON.stringify({ ...parameters, [name]: value }),
        ]),
    ),
    ['plant', JSON.stringify({ ...parameters, damping1: -0.1 })],
    ['plant', JSON.stringify(parameters).replace('9.81', '1e999')],
    ['observation', '{"max_velocity":[1,1]}'],
    ['observation', 'null'],
    ['reward_scale', '-1'],
    ['plant', undefined],
  ])('is refused with a %s of %s', (key, text) => {
    expect(() => new Policy(metadata(key, text))).toThrow(BadInput);
  });

  test('is read with a plant beyond the sliders, and marks stay within what can be set', () => {
    const plant = { ...parameters, mass1: 5, damping1: 0 };
    const policy = new Policy(
      changed(({ header }) => {
        const about = header.__metadata__ as Record<string, string>;
        about.plant = JSON.stringify({ ...plant, gear_ratio: 7 }); // on no slider
        about.config =
          'randomize_mass1 = 1e300\nrandomize_gravity = 0.5\nrandomize_delay = 1e9\ndelay = -3\n';
      }),
    );
    expect(policy.plant).toEqual({ ...plant, size: 1 });
    expect(policy.trainedRange('mass1')).toEqual([0.01, 100]);
    expect(policy.trainedRange('gravity')).toEqual([0.5 * 9.81, 1.5 * 9.81]);
    expect(policy.trainedDisturbance('delay')).toEqual([0, 50]);
  });

  test('is refused in one short line, whatever it contains', () => {
    const evil = `\u001b[31m\n${'x'.repeat(100_000)}`;
    for (const key of ['format', 'format_version', 'control_period']) {
      let line = '';
      try {
        new Policy(metadata(key, evil));
      } catch (error) {
        line = (error as Error).message;
      }
      expect(line).toContain('expected');
      expect(line.length).toBeLessThanOrEqual(200);
      expect(line).not.toMatch(/[\n\u001b]/);
    }
  });

  test('is refused after one weight changed', () => {
    const file = changed(({ header, data }) => {
      const [begin] = header['feature.0.weight']!.data_offsets as [number];
      new DataView(data.buffer).setFloat32(begin, 50, true);
    });
    expect(() => new Policy(file)).toThrow('self-check');
  });

  test('needs the right checksum if Upswing wrote it', () => {
    expect(new Policy(original).metadata.has('upswing_version')).toBe(true);
    const file = new Uint8Array(original);
    const last = file.length - 1; // of a sample
    for (const at of [100, last, last - 8, file.length >> 1, file.length >> 2]) {
      for (const bit of [1, 0x80]) {
        const broken = file.slice();
        broken[at]! ^= bit;
        expect(() => new Policy(broken.buffer), `byte ${at}`).toThrow(BadInput);
      }
    }
    const without = changed(({ header }) => (header.__metadata__!.upswing_version = '0.3.0'));
    expect(() => new Policy(without)).toThrow('"checksum": expected one');
    const wrong = changed(({ header }) => (header.__metadata__!.checksum = '0123456789abcdef'));
    expect(() => new Policy(wrong)).toThrow('checksum');
  });

  test('without a checksum is refused if its values differ by more than rounding', () => {
    const largest = Math.max(...float32Of(original, 'sample.q').map(Math.abs));
    const moved = (share: number) =>
      changed(({ header: { 'value.bias': bias }, data: bytes }) => {
        const [at] = bias!.data_offsets as [number];
        const view = new DataView(bytes.buffer);
        view.setFloat32(at, view.getFloat32(at, true) + share * largest, true);
      });
    expect(() => new Policy(moved(3e-5))).toThrow('self-check');
    expect(() => new Policy(moved(-3e-5))).toThrow('self-check');
    expect(new Policy(moved(3e-6)).controller.strongest).toBe(5);
  });

  test('is refused at every place where it may be cut off', () => {
    for (let bytes = 0; bytes < original.byteLength; bytes += 997) {
      expect(() => new Policy(original.slice(0, bytes))).toThrow(BadInput);
    }
  });
});
