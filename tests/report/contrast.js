// SPDX-License-Identifier: BSD-3-Clause
// Every kind of text with a contrast on its background below WCAG's AA, with its contrast.
() => {
  const light = (rgb) => {
    const [r, g, b] = rgb.map((v) => v / 255).map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const parse = (colour) => {
    pen.clearRect(0, 0, 1, 1); pen.fillStyle = colour; pen.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top, below) => [0, 1, 2].map((i) => top[i] * top[3] + below[i] * (1 - top[3]));
  const parents = (element) => (element ? [...parents(element.parentElement), element] : []);
  const behind = (element) => parents(element).reduce((below, e) => over(parse(getComputedStyle(e).backgroundColor), below), [255, 255, 255]);
  document.querySelectorAll("details").forEach((d) => { d.open = true; });
  const poor = {}, text = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let seen = 0;
  while (text.nextNode()) {
    const element = text.currentNode.parentElement, box = element.getBoundingClientRect(), style = getComputedStyle(element);
    if (!text.currentNode.textContent.trim() || element.closest("script, style, noscript") || !box.width || style.visibility === "hidden") continue;
    const opacity = parents(element).reduce((all, e) => all * parseFloat(getComputedStyle(e).opacity), 1);
    const below = behind(element), colour = parse(style.color);
    const [a, b] = [light(over([colour[0], colour[1], colour[2], colour[3] * opacity], below)), light(below)];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && parseInt(style.fontWeight) >= 700);
    seen += 1;
    if (ratio < (large ? 3 : 4.5)) poor[`${element.tagName}.${element.className} ${text.currentNode.textContent.trim().slice(0, 30)}`] = ratio;
  }
  return { seen, poor };
}
