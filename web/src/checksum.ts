/// The checksum of Upswing's files (docs/policy-format.md), which finds broken ones, not forged ones:
/// after FNV-1a, over words of 8 bytes, the last of each piece padded with zeros.
export class Checksum {
  // 64 bits in two halves.
  private low = 0x84222325;
  private high = 0xcbf29ce4;

  update(piece: Uint8Array): void {
    const padded = new Uint8Array(Math.ceil(piece.length / 8) * 8);
    padded.set(piece);
    const words = new DataView(padded.buffer);
    for (let at = 0; at < padded.length; at += 8) {
      const low = (this.low ^ words.getUint32(at, true)) >>> 0;
      const high = (this.high ^ words.getUint32(at + 4, true)) >>> 0;
      // Times 2^40 + 0x1b3; no sum goes beyond 2^53. Then the high half goes into the low one.
      const product = low * 0x1b3;
      this.high = (high * 0x1b3 + Math.floor(product / 2 ** 32) + low * 2 ** 8) >>> 0;
      this.low = ((product >>> 0) ^ this.high) >>> 0;
    }
  }

  /// 16 hexadecimal digits.
  hex(): string {
    return [this.high, this.low].map((half) => half.toString(16).padStart(8, '0')).join('');
  }
}
