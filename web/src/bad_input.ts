/// Unexpected input from outside. The message names the expected input in one line.
export class BadInput extends Error {}

/// Largest policy file or list that is read.
export const MAX_FILE_BYTES = 16 * 1024 * 1024;

export function largerThan(bytes: number): string {
  return `larger than ${bytes / 1024 / 1024} MB`;
}
