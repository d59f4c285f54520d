/// Input from outside that is not as expected; the message says in one line what was expected.
export class BadInput extends Error {}

/// Policies and lists that are longer are not read.
export const MAX_FILE_BYTES = 16 * 1024 * 1024;

export function largerThan(bytes: number): string {
  return `larger than ${bytes / 1024 / 1024} MB`;
}
