// The socket of a rig, opened again whenever it is lost.

import type { ClientRequest, ServerMessage } from "./protocol";

const AGAIN = 1000; // ms

export class Connection {
  private socket: WebSocket | undefined;
  private stopping = false;

  constructor(
    private readonly url: () => string,
    private readonly on: { received: (received: ServerMessage) => void; frame: (bytes: ArrayBuffer) => void; lost: () => void },
  ) {
    this.open();
  }

  get connected(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Whether it was sent; a stop is sent as soon as there is a connection again. */
  send(request: ClientRequest): boolean {
    if (this.connected) {
      this.socket!.send(JSON.stringify(request));
      return true;
    }
    this.stopping ||= request.do === "stop";
    return false;
  }

  private open(): void {
    const socket = (this.socket = new WebSocket(this.url()));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      if (this.stopping) this.send({ do: "stop" });
      this.stopping = false;
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === "string") this.on.received(JSON.parse(data) as ServerMessage);
      else this.on.frame(data);
    };
    socket.onclose = () => {
      this.on.lost();
      setTimeout(() => this.open(), AGAIN);
    };
  }
}
