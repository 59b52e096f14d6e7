// Elements by id, and new ones.

export function byId<T extends Element = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no #${id}`);
  return element as unknown as T;
}

export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Record<string, string> = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Text of an element, changed only where it differs: a screen reader hears every change of a status. */
export function say(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A number field with its label and unit; what is not a number between the limits is put back. */
export function field(
  label: string, unit: string, value: number, [low, high, step]: [number, number, number], change: (value: number) => void = () => {},
): { row: HTMLLabelElement; input: HTMLInputElement } {
  const input = make("input", { type: "number", min: `${low}`, max: `${high}`, step: `${step}`, value: `${value}` });
  let last = value;
  input.addEventListener("change", () => {
    const typed = input.valueAsNumber;
    if (typed >= low && typed <= high) change((last = typed));
    else input.value = `${last}`;
  });
  return { row: make("label", { class: "field" }, make("span", {}, label), make("span", {}, input, unit && ` ${unit}`)), input };
}

/** A symbol as it is printed: in italics. */
export const italic = (text: string): HTMLElement => make("i", {}, text);
