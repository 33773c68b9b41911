// Carries bytes between clients and a server, and cuts all connections when told so, or after so many bytes.

import { connect, createServer } from 'node:net';

export async function proxy(port) {
  const open = new Set();
  let carried = 0;
  const between = {
    /** Bytes to the clients after which the connections are cut, one cut each. */
    cutAfter: [],
    cuts: 0,
    /** Whether bytes stop on their way, with the connections open. */
    isFrozen: false,
    cut() {
      carried = 0;
      for (const socket of open) socket.destroy();
    },
    close() {
      listener.close();
      between.cut();
    },
  };
  const listener = createServer((client) => {
    const server = connect(port, '127.0.0.1');
    for (const [from, to] of [[client, server], [server, client]]) {
      open.add(from);
      from.on('error', () => undefined);
      from.on('close', () => {
        open.delete(from);
        to.destroy();
      });
      from.on('data', (data) => {
        if (between.isFrozen) return;
        if (!to.write(data)) from.pause();
        if (from === client) return;
        carried += data.length;
        if (between.cutAfter.length === 0 || carried < between.cutAfter[0]) return;
        between.cutAfter.shift();
        between.cuts += 1;
        between.cut();
      });
      to.on('drain', () => from.resume());
    }
  });
  await new Promise((resolve) => listener.listen(0, '127.0.0.1', resolve));
  listener.unref();
  between.address = `127.0.0.1:${listener.address().port}`;
  return between;
}
