// Opens a pile of the page of an ensemble in the player.
const piles = read('piles'), dialog = document.getElementById('shown');
let pilePlayer;
document.querySelectorAll('[data-pile]').forEach(button => button.addEventListener('click', () => {
  dialog.showModal();
  pilePlayer = pilePlayer || startPlayer(document.getElementById('player'));
  const pile = piles.runs[button.dataset.pile];
  dialog.querySelector('h3').textContent = pile.title;
  dialog.querySelector('.about').textContent = pile.about;
  if (pilePlayer) pilePlayer.load({ ...piles.tanks[pile.tank], ...pile.scene });
}));
dialog.querySelector('.close').addEventListener('click', () => dialog.close());
