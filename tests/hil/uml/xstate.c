/* Preloaded into User-Mode Linux 6.1, which hands the kernel 2696 bytes when it restores a process's extended processor
 * state. Processors with a larger state (AMX: 11008 bytes) exist; there the host refuses so short a buffer with EFAULT, and
 * the guest panics ("ptrace set fp regs failed, errno = 14"). This pads the buffer to the size that the host reports.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { X86_XSTATE = 0x202, XSTATE_BV = 512 };
static const uint64_t AMX_COMPONENTS = 3ull << 17;

static char padded[65536] __attribute__((aligned(64)));

/* Length of the extended state on this host. */
static size_t host_length(long pid)
{
	static size_t length;
	struct iovec all = { padded, sizeof padded };
	if (!length && syscall(SYS_ptrace, PTRACE_GETREGSET, pid, X86_XSTATE, &all) == 0)
		length = all.iov_len;
	return length;
}

static long set_xstate(long pid, const struct iovec *given)
{
	struct iovec all = { padded, host_length(pid) };
	if (given->iov_len >= all.iov_len)
		return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, X86_XSTATE, given);
	memset(padded, 0, all.iov_len);
	memcpy(padded, given->iov_base, given->iov_len);
	*(uint64_t *)(padded + XSTATE_BV) &= ~AMX_COMPONENTS; /* in their initial state: the padding says nothing of them */
	return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, X86_XSTATE, &all);
}

long ptrace(enum __ptrace_request request, ...)
{
	va_list rest;
	va_start(rest, request);
	long pid = va_arg(rest, int), address = va_arg(rest, long), data = va_arg(rest, long), word;
	va_end(rest);
	switch (request) {
	case PTRACE_PEEKTEXT:
	case PTRACE_PEEKDATA:
	case PTRACE_PEEKUSER: /* the system call stores the word; the C function returns it */
		if (syscall(SYS_ptrace, request, pid, address, &word) < 0)
			return -1;
		errno = 0;
		return word;
	case PTRACE_SETREGSET:
		if (address == X86_XSTATE)
			return set_xstate(pid, (const struct iovec *)data);
		/* fall through */
	default:
		return syscall(SYS_ptrace, request, pid, address, data);
	}
}
