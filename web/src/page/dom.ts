/// The element with this id, which index.html has.
export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

export function button(id: string, onClick: () => void): HTMLButtonElement {
  const found = element<HTMLButtonElement>(id);
  found.addEventListener('click', onClick);
  return found;
}

/// Writes only a text that has changed: each write makes the browser lay out again.
export function write(place: Element, text: string): void {
  if (place.textContent !== text) place.textContent = text;
}
