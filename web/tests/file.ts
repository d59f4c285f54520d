/// Takes policy files apart and builds changed ones, for tests.

export type Header = Record<string, Record<string, unknown>>;

export interface Parts {
  header: Header;
  data: Uint8Array;
}

export function fileOf(
  header: Record<string, unknown> | string,
  data: Uint8Array = new Uint8Array(),
): ArrayBuffer {
  const text = typeof header === 'string' ? header : JSON.stringify(header);
  const json = new TextEncoder().encode(text);
  const file = new Uint8Array(8 + json.length + data.length);
  new DataView(file.buffer).setBigUint64(0, BigInt(json.length), true);
  file.set(json, 8);
  file.set(data, 8 + json.length);
  return file.buffer;
}

function partsOf(file: ArrayBuffer): Parts {
  const size = Number(new DataView(file).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 8, size))) as Header;
  return { header, data: new Uint8Array(file.slice(8 + size)) };
}

export function tensorNames(file: ArrayBuffer): string[] {
  return Object.keys(partsOf(file).header).filter((name) => name !== '__metadata__');
}

/// The numbers of a tensor of F32.
export function float32Of(file: ArrayBuffer, tensor: string): Float32Array {
  const { header, data } = partsOf(file);
  const [begin, end] = header[tensor]!.data_offsets as [number, number];
  return new Float32Array(data.slice(begin, end).buffer);
}

/// A changed file as another program would write it, without a checksum.
export function changed(file: ArrayBuffer, change: (parts: Parts) => void): ArrayBuffer {
  const parts = partsOf(file);
  delete parts.header.__metadata__!.upswing_version;
  delete parts.header.__metadata__!.checksum;
  change(parts);
  return fileOf(parts.header, parts.data);
}

/// A file with another text of a metadatum; undefined: without the metadatum.
export function withMetadata(file: ArrayBuffer, key: string, text: string | undefined) {
  return changed(file, ({ header }) => {
    if (text === undefined) delete header.__metadata__![key];
    else header.__metadata__![key] = text;
  });
}

/// A file with another first number of a tensor of F32 or F64.
export function withNumber(file: ArrayBuffer, tensor: string, value: number, at = 0): ArrayBuffer {
  return changed(file, ({ header, data }) => {
    const { dtype, data_offsets } = header[tensor] as { dtype: string; data_offsets: number[] };
    const view = new DataView(data.buffer);
    if (dtype === 'F64') view.setFloat64(data_offsets[0]! + 8 * at, value, true);
    else view.setFloat32(data_offsets[0]! + 4 * at, value, true);
  });
}
