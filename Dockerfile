# The twin without ROS: docker build -t lg_husky . && docker run --rm -v "$PWD/out:/data/out" lg_husky
# Any verb: docker run --rm -v "$PWD:/data" -w /data lg_husky info drive
FROM python:3.12-slim
COPY . /opt/lg_husky_sim
# The environment is made once, here; ./run finds it and changes nothing.
ENV LG_HUSKY_VENV=/opt/venv MPLCONFIGDIR=/tmp/matplotlib NUMBA_CACHE_DIR=/tmp/numba
RUN /opt/lg_husky_sim/run --version && rm -rf /root/.cache
WORKDIR /data
ENTRYPOINT ["/opt/lg_husky_sim/run"]
