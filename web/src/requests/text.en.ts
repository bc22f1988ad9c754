/** English text of the API page; loaded with it. */

export const words = {
  title: "API",
  lead: "This page uses the same HTTP API that your programs can use.",

  first: {
    title: "Endpoints",
    address: "Address",
    document: "OpenAPI document",
    documentHint: "for client generators and OpenAPI viewers",
    docs: "Documentation",
    docsHint: "guides, reference and explanations for this version",
    socket: "Live values and events",
    socketHint: "WebSocket with JSON messages",
    version: "Version",
    session: "User",
    sessionOf: (name: string, role: string) => `${name}, role ${role}`,
    sessionOpen: "local access without a token",
    copy: "Copy",
    copied: "Copied",
    copyOf: (what: string) => `Copy: ${what}`,
  },

  sent: {
    title: "Recent requests",
    lead: "Requests made by this page, newest first. Dragged angles are sent over the WebSocket and are not listed.",
    reads: "Include reads",
    changes: "Changes only",
    filter: "Show",
    none: "No changes since this page was loaded.",
    noneAll: "No requests since this page was loaded.",
    curl: "Copy as curl",
    curlOf: (action: string) => `Copy as curl: ${action}`,
    python: "Copy as Python",
    pythonOf: (action: string) => `Copy as Python: ${action}`,
    copied: "Copied",
    head: { at: "Time", action: "Request", status: "Response" },
    noResponse: "no response",
    file: (type: string) => `file (${type})`,
    table: "Recent requests",
  },

  examples: {
    title: "Examples",
    lead: (name: string) => `Examples with the address of this server and ${name}.`,
    leadNone:
      "Examples with the address of this server. They include a servo's unique ID once a servo is known.",
    language: "Language of the examples",
    curl: "curl",
    python: "Python",
    begin: "Set up once",
    list: "List the servos",
    read: "Read one parameter",
    write: "Set a parameter in RAM",
    stop: "Stop all servos (no lease needed)",
    token: "The token is read from HORNBILL_TOKEN. Omit that line if the server uses no tokens.",
  },
};
