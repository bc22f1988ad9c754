/** English words of signing in and out; loaded with them. */

export const words = {
  title: "Sign in to hornbill",
  why: "This server moves servos, so access requires a token.",
  token: "Token",
  enter: "Sign in",
  unknown: "Invalid token. It may have been revoked or copied incompletely.",
  tooMany: (wait_s: number) => `Too many failed attempts. Try again in ${wait_s}\u202fs.`,
  stop: "STOP is still sent. The server accepts it from browsers that were signed in before and from its own computer. Otherwise cut the supply.",
  how: "The administrator of the server creates tokens with:",
  as: (name: string, role: string) => `${name}, ${role}`,
  roles: {
    view: "can view and stop",
    operate: "can move servos",
    configure: "can configure servos",
    admin: "can do everything",
  },
  leave: "Sign out",
};
