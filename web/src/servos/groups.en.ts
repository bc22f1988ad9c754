/** English headings of groups in the list. */
export const words = {
  rest: "Others",
  ok: "OK",
  notice: "Notice",
  warning: "Warning",
  protected: "Protected",
  failure: "Failure",
  busy: "Busy",
  identifying: "Identifying",
  offline: "Offline",
};
