/// Structs of numbers that the page and the core exchange (web/wasm/fields.h). The page names the
/// fields that it knows; the core's table has their places. Names that differ from the core's are an
/// error when the core starts.

interface Place {
  at: number; // of the first number
  count: number; // of numbers
}

type Table = ReadonlyMap<string, ReadonlyMap<string, Place>>;

/// Structs of the page before the core has started.
const waiting: { find(table: Table): void }[] = [];
let table: Table | null = null;

/// Names of fields; those of each part are in one object of the page, such as a plant.
type Parts = readonly (readonly string[])[];

/// A struct of the core whose fields come from one or more objects.
export class Fields<const P extends Parts> {
  private readonly struct: string;
  private readonly parts: P;
  private places: ReadonlyMap<string, Place> = new Map();
  private size_ = 0;

  /// `struct`: the core's name of the struct. `parts`: names of its fields, in any order.
  constructor(struct: string, ...parts: P) {
    this.struct = struct;
    this.parts = parts;
    if (table) this.find(table);
    else waiting.push(this);
  }

  /// Finds the places of the fields. Throws Error if the core's struct has other fields.
  find(table: Table): void {
    const { struct, parts } = this;
    const places = table.get(struct) ?? new Map<string, Place>();
    const [page, core] = [parts.flat(), [...places.keys()]].map((list) => list.sort().join(', '));
    if (page !== core) {
      throw new Error(`${struct}: the page expects the fields ${page}, the core has ${core}`);
    }
    this.places = places;
    this.size_ = [...places.values()].reduce((sum, { count }) => sum + count, 0);
  }

  /// The core's numbers of fields with one number each: an object for each part, whose other keys are
  /// left out.
  numbers(...values: { [K in keyof P]: Readonly<Record<P[K][number], number>> }): number[] {
    // Without a copy of all values, which would take several times as long as a formula.
    const numbers = new Array<number>(this.size_);
    this.parts.forEach((names, part) => {
      const given: Readonly<Record<string, number>> = values[part]!;
      for (const name of names) numbers[this.place(name).at] = given[name]!;
    });
    return numbers;
  }

  /// The number of a field.
  read(numbers: Float64Array, name: P[number][number]): number {
    return numbers[this.place(name).at]!;
  }

  /// A view of all numbers of a field.
  readAll(numbers: Float64Array, name: P[number][number]): Float64Array {
    const { at, count } = this.place(name);
    return numbers.subarray(at, at + count);
  }

  /// All fields, with one number each.
  object(numbers: Float64Array): Record<P[number][number], number> {
    const all: Record<string, number> = {};
    for (const [name, { at }] of this.places) all[name] = numbers[at]!;
    return all as Record<P[number][number], number>;
  }

  /// Count of all numbers.
  get size(): number {
    return this.size_;
  }

  private place(name: string): Place {
    const place = this.places.get(name);
    if (!place) throw new Error('the core has not been started');
    return place;
  }
}

/// Reads the core's table: a line for each struct with its name and NAME:COUNT of each field.
export function parseTable(text: string): Table {
  const structs = new Map<string, Map<string, Place>>();
  for (const line of text.trim().split('\n')) {
    const [struct, ...fields] = line.split(' ');
    const places = new Map<string, Place>();
    let at = 0;
    for (const field of fields) {
      const [name, count] = field.split(':');
      places.set(name!, { at, count: Number(count) });
      at += Number(count);
    }
    structs.set(struct!, places);
  }
  return structs;
}

/// Call with the core's table when it starts. Throws Error if a struct of the page differs.
export function findFields(text: string): void {
  table = parseTable(text);
  for (const fields of waiting.splice(0)) fields.find(table);
}
