// Boxes whose text is wider or higher than they are.
[...document.querySelectorAll('BOXES')].filter(tile => {
  const edge = tile.getBoundingClientRect();
  return [...tile.querySelectorAll('*')].some(text => {
    const range = document.createRange();
    range.selectNodeContents(text);
    const box = range.getBoundingClientRect();
    return box.right > edge.right + 0.5 || box.bottom > edge.bottom + 0.5;
  });
}).map(tile => tile.textContent)
