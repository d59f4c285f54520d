import { Checksum } from './checksum';
import { quoted } from './text';

/// A reader of safetensors files (https://huggingface.co/docs/safetensors) that trusts nothing: sizes
/// are bounded, offsets stay within the file, a header is data and never code.

export const MAX_FILE_BYTES = 16 * 1024 * 1024;
const MAX_HEADER_BYTES = 1024 * 1024;
const MAX_TENSORS = 200;

export interface Tensor {
  dtype: string;
  shape: number[];
  bytes: Uint8Array;
}

export interface TensorFile {
  metadata: Map<string, string>;
  tensors: Map<string, Tensor>;
}

/// Input from outside that is not as expected; the message says in one line what was expected.
export class BadInput extends Error {}

const BYTES: Record<string, number> = { F32: 4, F64: 8 };

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

/// Whole numbers from 0 on that a file of ours can have.
export function isSize(value: unknown): value is number {
  return Number.isInteger(value) && (value as number) >= 0 && (value as number) <= MAX_FILE_BYTES;
}

/// Throws at what is not UTF-8.
function textOf(bytes: Uint8Array): string {
  return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
}

function parseHeader(bytes: Uint8Array): Record<string, unknown> {
  let header: unknown;
  try {
    header = JSON.parse(textOf(bytes));
  } catch {
    throw new BadInput('the header is not JSON');
  }
  if (!isObject(header)) throw new BadInput('the header is not a JSON object');
  return header;
}

function parseTensor(name: string, entry: unknown, data: Uint8Array): Tensor {
  const broken = (what: string) => new BadInput(`tensor ${quoted(name)}: ${what}`);
  if (!isObject(entry)) throw broken('expected dtype, shape and data_offsets');
  const { dtype, shape, data_offsets: offsets } = entry;
  const size = typeof dtype === 'string' && Object.hasOwn(BYTES, dtype) ? BYTES[dtype]! : 0;
  if (typeof dtype !== 'string' || size === 0) throw broken('expected a dtype of F32 or F64');
  if (!Array.isArray(shape) || shape.length > 4 || !shape.every(isSize)) {
    throw broken('expected a shape of at most four sizes');
  }
  if (!Array.isArray(offsets) || offsets.length !== 2 || !offsets.every(isSize)) {
    throw broken('expected two data_offsets');
  }
  const [begin, end] = offsets as [number, number];
  const bytes = (shape as number[]).reduce((product, n) => product * n, size);
  if (begin > end || end > data.length || end - begin !== bytes) {
    throw broken(`expected ${bytes} bytes within the file, got ${begin} to ${end}`);
  }
  return { dtype, shape: shape as number[], bytes: data.subarray(begin, end) };
}

/// Throws unless the tensors, in their order, cover the data without a gap or an overlap, so that the size of the file
/// bounds the work.
function checkCovered(tensors: Tensor[], data: Uint8Array): void {
  const begin = ({ bytes }: Tensor) => bytes.byteOffset - data.byteOffset;
  let end = 0;
  for (const tensor of tensors) {
    if (begin(tensor) !== end) throw new BadInput('tensors overlap or leave a gap');
    end += tensor.bytes.length;
  }
  if (end !== data.length) throw new BadInput('tensors do not fill the file');
}

/// Throws unless the checksum is there that a file must have which says an upswing_version, and is
/// that of the header, with zeros in its place, and of the tensors in their order.
function checkChecksum(header: string, metadata: Map<string, string>, tensors: Tensor[]): void {
  const digits = metadata.get('checksum');
  if (digits === undefined) {
    if (!metadata.has('upswing_version')) return; // another program wrote it
    throw new BadInput('it says an upswing_version, but has no checksum');
  }
  const key = '"checksum":"';
  const at = header.indexOf(key) + key.length;
  if (at < key.length || digits.length !== 16) throw new BadInput('it has a broken checksum');
  const checksum = new Checksum();
  const zeros = header.slice(0, at) + '0'.repeat(16) + header.slice(at + 16);
  checksum.update(new TextEncoder().encode(zeros));
  for (const { bytes } of tensors) checksum.update(bytes);
  if (checksum.hex() !== digits) throw new BadInput('its checksum says that it is damaged');
}

/// Throws BadInput.
export function parseSafetensors(file: ArrayBuffer): TensorFile {
  if (file.byteLength > MAX_FILE_BYTES) throw new BadInput('it is larger than 16 MB');
  if (file.byteLength < 8) throw new BadInput('it is too short for a safetensors file');
  const headerBytes = Number(new DataView(file).getBigUint64(0, true));
  if (headerBytes > MAX_HEADER_BYTES || headerBytes > file.byteLength - 8) {
    throw new BadInput('it is not a safetensors file, or it is cut off');
  }
  const text = new Uint8Array(file, 8, headerBytes);
  const header = parseHeader(text);
  const data = new Uint8Array(file, 8 + headerBytes);

  const metadata = new Map<string, string>();
  const { __metadata__: about = {}, ...entries } = header;
  if (!isObject(about)) throw new BadInput('__metadata__ is not a JSON object');
  for (const [key, value] of Object.entries(about)) {
    if (typeof value !== 'string') throw new BadInput(`metadata ${quoted(key)} is not text`);
    metadata.set(key, value);
  }
  if (Object.keys(entries).length > MAX_TENSORS) {
    throw new BadInput(`more than ${MAX_TENSORS} tensors`);
  }
  const tensors = new Map(
    Object.entries(entries).map(([name, entry]) => [name, parseTensor(name, entry, data)]),
  );
  const inOrder = [...tensors.values()].sort(
    (a, b) => a.bytes.byteOffset - b.bytes.byteOffset || a.bytes.length - b.bytes.length,
  );
  checkCovered(inOrder, data);
  checkChecksum(textOf(text), metadata, inOrder);
  return { metadata, tensors };
}

/// The numbers of a tensor of this type and shape, all finite. Throws BadInput.
export function read(
  file: TensorFile,
  name: string,
  dtype: 'F32' | 'F64',
  shape: readonly number[],
): Float32Array | Float64Array {
  const tensor = file.tensors.get(name);
  if (!tensor) throw new BadInput(`expected a tensor ${quoted(name)}, found none`);
  if (tensor.dtype !== dtype || tensor.shape.join() !== shape.join()) {
    const got = `${tensor.dtype} (${tensor.shape.join(', ')})`;
    throw new BadInput(
      `tensor ${quoted(name)}: expected ${dtype} (${shape.join(', ')}), got ${got}`,
    );
  }
  // Copied, because their place in the file may not be aligned for an array of numbers.
  const { buffer } = tensor.bytes.slice();
  const values = dtype === 'F32' ? new Float32Array(buffer) : new Float64Array(buffer);
  if (!values.every(Number.isFinite)) throw new BadInput(`tensor ${quoted(name)} is not finite`);
  return values;
}
