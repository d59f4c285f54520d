import { MAX_FILE_BYTES } from '../bad_input';

/// Data that this browser keeps between visits. If the browser forbids it (private windows,
/// settings), nothing is kept and nothing fails.

const PREFIX = 'upswing-';
const DATABASE = 'upswing';
const FILES = 'files';
const PATIENCE = 3000; // ms until a database counts as missing

export function recall(key: string): string | null {
  try {
    return localStorage.getItem(PREFIX + key);
  } catch {
    return null;
  }
}

export function remember(key: string, value: string): void {
  try {
    localStorage.setItem(PREFIX + key, value);
  } catch {
    // the browser forbids it
  }
}

export interface KeptFile {
  name: string;
  bytes: ArrayBuffer;
  learned: boolean; // in the page, so the page's next policy may replace it
  recipe?: string | undefined; // part of an address with which it learns again
}

function openDatabase(): Promise<IDBDatabase> {
  return new Promise((resolve, reject) => {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(FILES);
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/// The result of a request to the store of files, once it is on disk. Rejects if the browser
/// refuses.
async function transact(
  mode: IDBTransactionMode,
  use: (store: IDBObjectStore) => IDBRequest,
): Promise<unknown> {
  const database = await openDatabase();
  try {
    return await new Promise((resolve, reject) => {
      const transaction = database.transaction(FILES, mode);
      const request = use(transaction.objectStore(FILES));
      transaction.oncomplete = () => resolve(request.result);
      transaction.onerror = transaction.onabort = () => reject(transaction.error);
    });
  } finally {
    database.close();
  }
}

/// The result of `work`; null if it fails or takes too long.
function tolerant<T>(work: () => Promise<T>): Promise<T | null> {
  const patience = new Promise<null>((resolve) => setTimeout(() => resolve(null), PATIENCE));
  return Promise.race([Promise.resolve().then(work), patience]).catch(() => null);
}

/// A kept file, perhaps from an earlier version of the page; null if it is not one of ours.
function asKeptFile(value: unknown): KeptFile | null {
  const given = (value ?? {}) as Partial<Record<keyof KeptFile, unknown>>;
  const { name, bytes, learned } = given;
  if (typeof name !== 'string' || !(bytes instanceof ArrayBuffer)) return null;
  if (bytes.byteLength > MAX_FILE_BYTES) return null;
  const recipe = typeof given.recipe === 'string' ? given.recipe : undefined;
  return { name, bytes, learned: learned === true, recipe };
}

export async function recallFile(key: string): Promise<KeptFile | null> {
  return asKeptFile(await tolerant(() => transact('readonly', (files) => files.get(key))));
}

/// Keeps a file. False if the browser refuses.
export async function rememberFile(key: string, file: KeptFile): Promise<boolean> {
  const done = tolerant(() => transact('readwrite', (files) => files.put(file, key)));
  return (await done) !== null;
}

export async function forgetFile(key: string): Promise<void> {
  await tolerant(() => transact('readwrite', (files) => files.delete(key)));
}
