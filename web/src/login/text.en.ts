/** The English sentences of signing in and out; loaded with them. */

export const words = {
  title: "Sign in to hornbill",
  why: "This server moves servos, so it wants to know who you are.",
  token: "Token",
  enter: "Sign in",
  unknown: "No token is like this one. Perhaps it was revoked, or not all of it was copied.",
  tooMany: (wait_s: number) => `Too many attempts have failed. Try again in ${wait_s}\u202fs.`,
  stop: "A press of STOP is still sent. It counts from whoever was signed in here before, and on the machine itself; else cut the supply.",
  how: "Whoever runs the server makes tokens with:",
  as: (name: string, role: string) => `${name}, ${role}`,
  roles: {
    view: "may look and stop",
    operate: "may move servos",
    configure: "may configure servos",
    admin: "may do everything",
  },
  leave: "Sign out",
};
