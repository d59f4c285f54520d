import { BadInput, largerThan } from '../bad_input';

const PATIENCE = 30; // s without a byte, after which a fetch fails

/// A file in the page itself (build/single.ts), as base64 of gzip; null if the page does not have it.
async function held(address: string): Promise<Uint8Array<ArrayBuffer> | null> {
  const name = address.split('/').at(-1);
  const files = document.querySelectorAll<HTMLScriptElement>('script[data-file]');
  const text = Array.from(files).find(({ dataset }) => dataset.file === name)?.text;
  if (text === undefined) return null;
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const whole = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(whole).arrayBuffer());
}

/// Fetches at most `limit` bytes. `onProgress` gets the number of bytes so far. Throws BadInput if
/// the file is missing or too large, or if the server cannot be reached or falls silent.
export async function fetchBytes(
  address: string,
  limit: number,
  onProgress: (bytes: number) => void = () => {},
): Promise<Uint8Array<ArrayBuffer>> {
  const here = await held(address);
  if (here) return here;
  const abort = new AbortController();
  let timer: ReturnType<typeof setTimeout>;
  const listen = async <T>(answer: Promise<T>): Promise<T> => {
    clearTimeout(timer);
    timer = setTimeout(() => abort.abort(), 1000 * PATIENCE);
    try {
      return await answer;
    } catch {
      throw new BadInput(
        abort.signal.aborted
          ? `${address}: nothing arrived for ${PATIENCE} s`
          : navigator.onLine
            ? `${address} cannot be fetched`
            : `${address} cannot be fetched, because the device is offline`,
      );
    }
  };
  try {
    const response = await listen(fetch(address, { signal: abort.signal }));
    if (response.status === 404) throw new BadInput(`${address} is missing`);
    if (!response.ok) throw new BadInput(`${address}: the server says ${response.status}`);
    const reader = response.body!.getReader();
    const pieces: Uint8Array<ArrayBuffer>[] = [];
    let bytes = 0;
    for (
      let piece = await listen(reader.read());
      !piece.done;
      piece = await listen(reader.read())
    ) {
      pieces.push(piece.value);
      bytes += piece.value.length;
      onProgress(bytes);
      if (bytes > limit) throw new BadInput(`${address} is ${largerThan(limit)}`);
    }
    return new Uint8Array(await new Blob(pieces).arrayBuffer());
  } finally {
    clearTimeout(timer!);
    abort.abort(); // stops the rest of the download
  }
}
