# The digest is that of docker-library/repo-info for this tag; for a newer one: docker buildx imagetools inspect TAG
FROM python:3.11.15-slim-bookworm@sha256:d29f48a31a8b408ed19272ca1e7b10ebae13b240a27e862d3d4217c528e2e0c3
WORKDIR /srv
COPY requirements.lock pyproject.toml README.md ./
RUN python -m pip install --no-cache-dir --require-hashes -r requirements.lock
COPY solvers solvers
COPY app app
COPY migrations migrations
# Of the extras, [cluster] for Dask; their packages come at the versions that the development lock has.
ARG EXTRAS=""
COPY requirements-dev.lock ./
RUN python -m pip install --no-cache-dir --no-deps . \
    && if [ -n "$EXTRAS" ]; then sed 's/ *\\$//; /^ *--hash/d' requirements-dev.lock > constraints.txt \
        && python -m pip install --no-cache-dir --constraint constraints.txt ".$EXTRAS"; fi \
    && useradd --uid 10001 --create-home crankwright && mkdir data && chown crankwright data
USER crankwright
# Compile the kernels now, not at the first request: for the processor at hand, and for any of its kind. On another
# processor than this one a container that is given NUMBA_CPU_NAME=generic starts with the latter at once; without it, it
# compiles its own at its first start, while pages are served.
RUN crankwright warm-up && NUMBA_CPU_NAME=generic crankwright warm-up
ENV CRANKWRIGHT_HOST=0.0.0.0 CRANKWRIGHT_DATABASE_URL=sqlite:////srv/data/crankwright.sqlite3 PYTHONDONTWRITEBYTECODE=1
VOLUME /srv/data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=60s CMD python -c "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/readyz')"
# Bound to all addresses of the container it asks for keys, unless CRANKWRIGHT_OPEN=1.
CMD ["crankwright", "serve"]
