/* The socket to the server: moments come in, messages go out. It opens again by itself. */

const AGAIN_MS = 1000;

export class Link {
  /* onMoment(state, pictures) draws and returns a promise; onOpen(isOpen) tells whether there is a connection. */
  constructor(onMoment, onOpen) {
    this.onMoment = onMoment;
    this.onOpen = onOpen;
    this.socket = null;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.onOpen(true);
    let last = Promise.resolve(); // one moment after the other, or an older one may be drawn over a newer one
    socket.onmessage = (event) => { last = last.then(() => this.receive(event.data)); };
    socket.onclose = () => {
      this.onOpen(false);
      setTimeout(() => this.open(), AGAIN_MS);
    };
    this.socket = socket;
  }

  send(message) {
    if (this.socket && this.socket.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify(message));
      return true;
    }
    return false;
  }

  /* A message is the length of the header (4 bytes, little-endian), the header as JSON, and the pictures it names. */
  async receive(data) {
    const length = new DataView(data).getUint32(0, true);
    const state = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const pictures = {};
    let start = 4 + length;
    for (const [name, size] of state.pictures) {
      pictures[name] = new Blob([new Uint8Array(data, start, size)]);
      start += size;
    }
    const delay = await this.onMoment(state, pictures);
    this.send({ kind: "seen", number: state.number, delay_ms: delay });
  }
}
