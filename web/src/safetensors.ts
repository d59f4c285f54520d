export const MAX_FILE_BYTES = 16 * 1024 * 1024;

/// Input from outside that is not as expected; the message says in one line what was expected.
export class BadInput extends Error {}
