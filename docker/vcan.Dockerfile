# Bus container: creates vcan0 in its network namespace. Includes can-utils to inspect it.
FROM debian:bookworm-slim
RUN apt-get update \
    && apt-get install --yes --no-install-recommends can-utils iproute2 \
    && rm -rf /var/lib/apt/lists/*
COPY vcan-up /usr/local/bin/vcan-up
STOPSIGNAL SIGKILL
HEALTHCHECK --interval=2s --timeout=2s --retries=5 CMD ["sh", "-c", "ip link show vcan0 | grep -q '[<,]UP[,>]'"]
CMD ["vcan-up"]
