/// The element of index.html with this id.
export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

export function button(id: string, onClick: () => void): HTMLButtonElement {
  const found = element<HTMLButtonElement>(id);
  found.addEventListener('click', onClick);
  return found;
}

/// Writes a text only if it has changed, because each write triggers a new layout.
export function write(place: Element, text: string): void {
  if (place.textContent !== text) place.textContent = text;
}
