/* The least that a program can do between two wheels' frames and somebody who waits for a pose: a yardstick for colocd.
 *
 * It reads the frames of both wheels (coloc.dbc, checksum and all), predicts a Kalman filter of three states, and sends pose and
 * covariance as a Unix datagram. No other sensors, no late measurements, no faults: who needs those adds them here.
 *
 *     plain BUS[,BUS] SOCKET BYTES CPU PRIORITY UNTIL_NS
 *
 * BUS is `local:DIRECTORY` or `socketcan:INTERFACE`. BYTES long is the datagram; CPU -1: any; PRIORITY 0: ordinary, else SCHED_FIFO.
 * It ends when CLOCK_BOOTTIME is UNTIL_NS. `coloc latency --plain` compiles and runs it. */
#define _GNU_SOURCE
#include <linux/can.h>
#include <linux/can/raw.h>
#include <math.h>
#include <net/if.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

enum { LEFT = 0x100, RIGHT = 0x101, BUSES = 2, MOST_BYTES = 4096 };

static const double METRES_PER_TICK = 1e-6, TRACK_M = 0.258;
/* Variances a metre and a radian, as of a usual robot. */
static const double ALONG = 4e-4, TURNING = 4e-4;

struct wheel {
    uint32_t ticks;
    int known, fresh;
    int64_t stamp_ns;
};

struct belief {
    double pose[3], covariance[3][3];
};

static void fail(const char *what) {
    perror(what);
    exit(1);
}

static int64_t now_ns(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int open_local(const char *directory, int number) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) fail("socket");
    int length = snprintf(address.sun_path, sizeof address.sun_path, "%s/%d-%d-0", directory, (int)getpid(), number);
    if (length < 0 || (size_t)length >= sizeof address.sun_path) {
        fprintf(stderr, "%s: too long\n", directory);
        exit(1);
    }
    if (bind(fd, (struct sockaddr *)&address, sizeof address)) fail(directory);
    return fd;
}

static int open_can(const char *interface) {
    struct can_filter wheels = {.can_id = LEFT, .can_mask = 0x7fe | CAN_EFF_FLAG | CAN_RTR_FLAG};
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(interface)};
    int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) fail("socket");
    if (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, &wheels, sizeof wheels)) fail("filter");
    if (bind(fd, (struct sockaddr *)&address, sizeof address)) fail(interface);
    return fd;
}

static int open_bus(const char *bus, int number) {
    const char *place = strchr(bus, ':');
    if (!place) {
        fprintf(stderr, "%s: neither local:DIRECTORY nor socketcan:INTERFACE\n", bus);
        exit(1);
    }
    int fd = bus[0] == 'l' ? open_local(place + 1, number) : open_can(place + 1);
    int on = 1;
    struct timeval patience = {.tv_usec = 100000};
    if (setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on)) fail("stamps");
    if (setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience)) fail("patience");
    return fd;
}

static void settle(int cpu, int priority) {
    if (cpu >= 0) {
        cpu_set_t cpus;
        CPU_ZERO(&cpus);
        CPU_SET(cpu, &cpus);
        (void)sched_setaffinity(0, sizeof cpus, &cpus);
    }
    struct sched_param parameters = {.sched_priority = priority};
    /* Where it is refused, the figures show it, as they do for colocd. */
    if (priority > 0) (void)sched_setscheduler(0, SCHED_FIFO, &parameters);
    (void)mlockall(MCL_CURRENT | MCL_FUTURE);
}

/* The kernel's stamp of the frame [ns of CLOCK_REALTIME]; -1 if there is none. */
static int64_t receive(int fd, struct can_frame *frame, int flags) {
    union {
        struct cmsghdr header;
        char room[CMSG_SPACE(sizeof(struct timespec))];
    } control;
    struct iovec data = {.iov_base = frame, .iov_len = sizeof *frame};
    struct msghdr message = {
        .msg_iov = &data, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control};
    if (recvmsg(fd, &message, flags) != sizeof *frame) return -1;
    struct cmsghdr *header = CMSG_FIRSTHDR(&message);
    if (!header || header->cmsg_type != SCM_TIMESTAMPNS) return -1;
    struct timespec stamp;
    memcpy(&stamp, CMSG_DATA(header), sizeof stamp);
    return (int64_t)stamp.tv_sec * 1000000000 + stamp.tv_nsec;
}

static uint8_t checksum(const struct can_frame *frame) {
    uint8_t bytes[7] = {(uint8_t)frame->can_id, (uint8_t)(frame->can_id >> 8)}, crc = 0xff;
    memcpy(bytes + 2, frame->data, 5);
    for (int i = 0; i < 7; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) crc = (uint8_t)(crc & 0x80 ? crc << 1 ^ 0x1d : crc << 1);
    }
    return (uint8_t)~crc;
}

/* How far the wheel has come since its frame before [m]. */
static double advance(struct wheel *wheel, uint32_t ticks) {
    double way_m = wheel->known ? (int32_t)(ticks - wheel->ticks) * METRES_PER_TICK : 0.0;
    wheel->ticks = ticks;
    wheel->known = 1;
    return way_m;
}

static void predict(struct belief *belief, double left_m, double right_m) {
    double way = (left_m + right_m) / 2, turn = (right_m - left_m) / TRACK_M;
    double direction = belief->pose[2] + turn / 2, c = cos(direction), s = sin(direction);
    double f[3][3] = {{1, 0, -way * s}, {0, 1, way * c}, {0, 0, 1}}, product[3][3] = {{0}}, next[3][3] = {{0}};
    double along = ALONG * fabs(way), turning = TURNING * (fabs(turn) + fabs(way));
    belief->pose[0] += way * c;
    belief->pose[1] += way * s;
    belief->pose[2] = remainder(belief->pose[2] + turn, 2 * M_PI);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) product[i][j] += f[i][k] * belief->covariance[k][j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) next[i][j] += product[i][k] * f[j][k];
    next[0][0] += along * c * c;
    next[0][1] += along * c * s;
    next[1][0] += along * c * s;
    next[1][1] += along * s * s;
    next[2][2] += turning;
    memcpy(belief->covariance, next, sizeof next);
}

int main(int count, char **words) {
    if (count != 7) {
        fprintf(stderr, "usage: plain BUS[,BUS] SOCKET BYTES CPU PRIORITY UNTIL_NS\n");
        return 2;
    }
    int buses[BUSES], opened = 0, epoll = epoll_create1(EPOLL_CLOEXEC);
    for (char *bus = strtok(words[1], ","); bus && opened < BUSES; bus = strtok(NULL, ",")) {
        buses[opened] = open_bus(bus, opened);
        struct epoll_event event = {.events = EPOLLIN, .data.fd = buses[opened]};
        if (epoll_ctl(epoll, EPOLL_CTL_ADD, buses[opened++], &event)) fail("epoll");
    }
    struct sockaddr_un reader = {.sun_family = AF_UNIX};
    strncpy(reader.sun_path, words[2], sizeof reader.sun_path - 1);
    int out = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (out < 0 || connect(out, (struct sockaddr *)&reader, sizeof reader)) fail(words[2]);
    static char message[MOST_BYTES];
    size_t bytes = strtoul(words[3], NULL, 10);
    if (bytes > sizeof message) bytes = sizeof message;
    settle(atoi(words[4]), atoi(words[5]));
    int64_t until_ns = strtoll(words[6], NULL, 10);
    puts("ready");
    fflush(stdout);

    struct wheel wheels[2] = {{0}};
    double ways[2] = {0};
    struct belief belief = {.covariance = {{1e-4, 0, 0}, {0, 1e-4, 0}, {0, 0, 1e-4}}};
    while (now_ns(CLOCK_BOOTTIME) < until_ns) {
        struct epoll_event event = {.data.fd = buses[0]};
        if (opened > 1 && epoll_wait(epoll, &event, 1, 100) < 1) continue;
        struct can_frame frame;
        int64_t stamp_ns = receive(event.data.fd, &frame, opened > 1 ? MSG_DONTWAIT : 0);
        if (stamp_ns < 0) continue;
        int side = (int)frame.can_id - LEFT;
        if (side < 0 || side > 1 || frame.data[5] != checksum(&frame)) continue;
        uint32_t ticks;
        memcpy(&ticks, frame.data, sizeof ticks);
        ways[side] += advance(&wheels[side], ticks);
        wheels[side].fresh = 1;
        wheels[side].stamp_ns = stamp_ns;
        if (!wheels[0].fresh || !wheels[1].fresh) continue;
        predict(&belief, ways[0], ways[1]);
        int64_t newest_ns = wheels[0].stamp_ns > wheels[1].stamp_ns ? wheels[0].stamp_ns : wheels[1].stamp_ns;
        int64_t boot_ns = newest_ns + now_ns(CLOCK_BOOTTIME) - now_ns(CLOCK_REALTIME);
        memcpy(message, &boot_ns, sizeof boot_ns);
        memcpy(message + sizeof boot_ns, &belief, sizeof belief);
        /* Who does not read loses it. */
        (void)send(out, message, bytes, MSG_DONTWAIT);
        ways[0] = ways[1] = 0;
        wheels[0].fresh = wheels[1].fresh = 0;
    }
    return 0;
}
