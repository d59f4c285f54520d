/// The torques that a Gaussian actor would draw while it learns: with u ~ N(mean, σ²),
/// limit · tanh(u), or limit · u cut off at the limit.

const LOG_STD = [-5, 2] as const; // ln σ is clamped to this range, as in nn/gaussian.h

export class GaussianTorque {
  readonly limit: number; // N·m
  readonly squashed: boolean; // by tanh
  private readonly mu: number;
  private readonly sigma: number;

  constructor(limit: number, squashed: boolean, mu: number, logSigma: number) {
    this.limit = limit;
    this.squashed = squashed;
    this.mu = mu;
    this.sigma = Math.exp(Math.min(Math.max(logSigma, LOG_STD[0]), LOG_STD[1]));
  }

  /// The torque of the mean, which the policy applies.
  get mean(): number {
    return this.torqueOf(this.mu);
  }
  /// The ends of the central 68%: one standard deviation of u to both sides.
  get low(): number {
    return this.torqueOf(this.mu - this.sigma);
  }
  get high(): number {
    return this.torqueOf(this.mu + this.sigma);
  }

  /// Probability of u up to the one that stands for `torque`. At the ends of the range, what is cut
  /// off is not part of it: P(-limit) is what is cut off there, 1 - P(limit) what is at the other end.
  upTo(torque: number): number {
    const share = torque / this.limit;
    const u = this.squashed ? Math.atanh(share) : share;
    return normal((u - this.mu) / this.sigma);
  }

  /// Density (1/(N·m)) in each of `pieces` equal pieces of the range from -limit to limit, as the mean
  /// over the piece: a squashed one may be steeper at an end than any chart can show.
  density(pieces: number): Float64Array {
    const width = (2 * this.limit) / pieces;
    const density = new Float64Array(pieces);
    let below = this.upTo(-this.limit);
    for (let i = 0; i < pieces; ++i) {
      const end = i === pieces - 1 ? this.limit : -this.limit + (i + 1) * width;
      const upTo = this.upTo(end);
      density[i] = (upTo - below) / width;
      below = upTo;
    }
    return density;
  }

  private torqueOf(u: number): number {
    return this.limit * (this.squashed ? Math.tanh(u) : Math.min(Math.max(u, -1), 1));
  }
}

// Of erfc: Chebyshev coefficients in an exponent (Press et al., Numerical Recipes, 3rd ed., 6.2.2),
// right to 1.2e-7 of its value everywhere.
const ERFC = [
  -1.26551223, 1.00002368, 0.37409196, 0.09678418, -0.18628806, 0.27886807, -1.13520398, 1.48851587,
  -0.82215223, 0.17087277,
];

/// The share of a standard normal distribution that is below x.
export function normal(x: number): number {
  const z = Math.abs(x) / Math.SQRT2;
  if (z === Infinity) return x < 0 ? 0 : 1;
  const t = 1 / (1 + z / 2);
  const series = ERFC.reduceRight((sum, c) => sum * t + c, 0);
  const tail = (t * Math.exp(-z * z + series)) / 2;
  return x < 0 ? tail : 1 - tail;
}
