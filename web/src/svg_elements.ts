// Elements of a figure in SVG, and the width of its texts.

export const kNamespace = "http://www.w3.org/2000/svg";
/** Of the text of a tick. */
export const kLineHeight = 14;
export const kTickSize = 12;
export const kLabelSize = 13;

export function element(parent: Element, name: string, attributes: Record<string, string | number>): SVGElement {
  const made = document.createElementNS(kNamespace, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  parent.append(made);
  return made;
}

let measuring: CanvasRenderingContext2D | null = null;
/** The width of a tick's text. */
export function text_width(text: string): number {
  measuring ??= document.createElement("canvas").getContext("2d");
  if (!measuring) return 7 * text.length;
  measuring.font = '12px "DejaVu Sans", system-ui, sans-serif';
  return measuring.measureText(text).width;
}

/** A text with at most this width; `scale` is the size of its letters over those of a tick. */
export function shortened(text: string, room: number, scale: number): string {
  if (scale * text_width(text) <= room) return text;
  let length = text.length;
  while (length > 4 && scale * text_width(`${text.slice(0, length)}…`) > room) --length;
  return `${text.slice(0, length)}…`;
}
