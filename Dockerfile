# One image with the entry point `hornbill`. Guide: docs/docker.md.
ARG PYTHON=3.12
ARG NODE=20

# The page.
FROM node:${NODE}-slim AS page
WORKDIR /src/web
COPY web/package.json web/package-lock.json ./
RUN npm ci --no-audit --no-fund
COPY web ./
RUN npm run build

# The documentation. Its pages link to source files, so it needs the whole context.
FROM python:${PYTHON}-slim AS docs
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /src
COPY requirements-docs.lock ./
RUN python -m pip install --require-hashes --no-deps -r requirements-docs.lock
COPY . .
RUN python -m sphinx -q -W -j auto -c docs/site -d /tmp/doctrees . docs/dist

# The wheel, and an environment with it and the locked packages. The environment has no pip.
FROM python:${PYTHON}-slim AS installed
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /src
COPY requirements.lock requirements-dev.lock ./
RUN python -m venv --without-pip /opt/hornbill \
    && python -m pip --python /opt/hornbill/bin/python install --require-hashes --no-deps -r requirements.lock
# The build packages are locked, too, in the developers' lock.
RUN awk '/^[a-z]/ { keep = /^(hatchling|packaging|pathspec|pluggy|trove-classifiers)==/ } keep' requirements-dev.lock \
    > build.lock && python -m pip install --require-hashes --no-deps -r build.lock
COPY pyproject.toml README.md LICENSE THIRD_PARTY.md ./
COPY schemas schemas
COPY server server
COPY --from=page /src/web/dist web/dist
COPY --from=docs /src/docs/dist docs/dist
COPY tools/__init__.py tools/notices.py tools/sbom.py tools/
COPY web/package-lock.json web/
RUN python -m tools.sbom > /opt/hornbill/sbom.cdx.json
ARG REVISION=""
RUN HORNBILL_COMMIT="${REVISION}" python -m pip wheel --no-deps --no-build-isolation --wheel-dir /wheel . \
    && python -m pip --python /opt/hornbill/bin/python install --no-deps /wheel/hornbill-*.whl

FROM python:${PYTHON}-slim
RUN python -m pip uninstall --yes --quiet --root-user-action=ignore pip \
    && useradd --uid 1000 --create-home --shell /usr/sbin/nologin hornbill \
    && install --directory --owner=hornbill --group=hornbill /data
COPY --from=installed /opt/hornbill /opt/hornbill
ENV PATH=/opt/hornbill/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    HORNBILL_CONTAINER=1 \
    HORNBILL_DATA_DIR=/data
ARG VERSION=""
ARG REVISION=""
LABEL org.opencontainers.image.title="hornbill" \
    org.opencontainers.image.description="Configure and control Futaba BLA servos over DroneCAN" \
    org.opencontainers.image.licenses="Apache-2.0" \
    org.opencontainers.image.version="${VERSION}" \
    org.opencontainers.image.revision="${REVISION}"
USER hornbill
WORKDIR /data
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGINT
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s --retries=3 \
    CMD ["python", "-c", "import os, ssl, urllib.request as r; e = os.environ.get; tls = e('HORNBILL_TLS_CERT'); r.urlopen(f\"http{'s' if tls else ''}://127.0.0.1:{e('HORNBILL_PORT', '8000')}/ready\", timeout=4, context=ssl._create_unverified_context() if tls else None)"]
ENTRYPOINT ["hornbill"]
CMD ["demo", "--host", "0.0.0.0"]
